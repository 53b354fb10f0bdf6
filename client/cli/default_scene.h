// The scene that a line means when it names none: chosen by `use` in a script, or by LOCUS_SCENE. For commands with a
// SCENE and for run_line. Functions without state.
#ifndef LOCUS_CLIENT_CLI_DEFAULT_SCENE_H_
#define LOCUS_CLIENT_CLI_DEFAULT_SCENE_H_

#include <optional>
#include <string>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// The required positional SCENE. It is the command's first positional, and the only one that a default stands in for.
CLI::Option& add_scene_argument(CLI::App& command, std::string& scene);

// `arguments` with `scene` put where the SCENE of the command they name stands; nothing if that command has none.
std::optional<std::vector<std::string>> with_scene(const CLI::App& app, const std::vector<std::string>& arguments,
                                                   const std::string& scene);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_DEFAULT_SCENE_H_
