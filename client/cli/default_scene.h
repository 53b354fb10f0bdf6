// The default scene, used by lines that name none: set by `use` in a script, or by the environment's LOCUS_SCENE. For
// commands with an argument SCENE, and for run_line(). Functions without state.
#ifndef LOCUS_CLIENT_CLI_DEFAULT_SCENE_H_
#define LOCUS_CLIENT_CLI_DEFAULT_SCENE_H_

#include <optional>
#include <string>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// Adds the required positional SCENE. It must be the command's first positional, and is the only one that may be
// omitted if there is a default scene.
CLI::Option& add_scene_argument(CLI::App& command, std::string& scene);

// Returns `arguments` with `scene` inserted as the SCENE of the command they name; none if that command takes no SCENE.
std::optional<std::vector<std::string>> with_scene(const CLI::App& app, const std::vector<std::string>& arguments,
                                                   const std::string& scene);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_DEFAULT_SCENE_H_
