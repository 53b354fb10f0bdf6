// Default scene, which replaces a missing SCENE argument. It is set by `use` in a script, or by the environment
// variable LOCUS_SCENE. For commands with the argument SCENE, and for run_line(). Functions without state.
#ifndef LOCUS_CLIENT_CLI_DEFAULT_SCENE_H_
#define LOCUS_CLIENT_CLI_DEFAULT_SCENE_H_

#include <optional>
#include <string>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// Adds the required positional argument SCENE. It must be the command's first positional, since with_scene() inserts
// the default scene directly after the command's name.
CLI::Option& add_scene_argument(CLI::App& command, std::string& scene);

// Returns `arguments` with `scene` inserted directly after the name of the command; nullopt if that command has no
// argument SCENE.
std::optional<std::vector<std::string>> with_scene(const CLI::App& app, const std::vector<std::string>& arguments,
                                                   const std::string& scene);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_DEFAULT_SCENE_H_
