// Upward axis of a scene: its label `up`, which import and generate set when they create the scene. render and export
// use it. Functions without state.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_SCENE_UP_H_
#define LOCUS_CLIENT_CLI_COMMANDS_SCENE_UP_H_

#include <optional>
#include <string>

#include "CLI/CLI.hpp"
#include "client/cli/levels/export/glb_writer.h"
#include "client/lib/client.h"

namespace locus::cli {

// Key of the label; its values are those of up_name().
inline constexpr char kUpLabel[] = "up";

// Returns the upward axis of the scene: that of its label, and z if it has none.
UpAxis up_of(const v1::Scene& scene);

// Returns the upward axis of a level from a file of the format ImportedLevel::source_format: y for glTF and GLB, whose
// standard says so, and z for all others.
UpAxis up_of_format(const std::string& source_format);

// Returns "y" or "z".
std::string up_name(UpAxis up);

// Adds the option --up, whose value is y or z.
void add_up_option(CLI::App& command, std::optional<UpAxis>& up, const std::string& description);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_SCENE_UP_H_
