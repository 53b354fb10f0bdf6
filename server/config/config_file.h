// Finds lines of locusd's config file, for messages about options and their values. CLI11, which reads the file,
// forgets the numbers of the lines. Functions without state.
#ifndef LOCUS_SERVER_CONFIG_CONFIG_FILE_H_
#define LOCUS_SERVER_CONFIG_CONFIG_FILE_H_

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace locus::server {

// Returns the numbers of the lines in the file `path` that set the option `name`, as text such as "3" or "3,7"; empty
// if no line sets the option.
std::string lines_that_set(const std::string& path, const std::string& name);

// Returns the message for an error that parsing `arguments` with `app` caused. If the file of --config caused it, the
// message begins with the file and the number of the line.
std::string with_line_of_file(const CLI::App& app, const std::vector<std::string>& arguments, const CLI::Error& error);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_CONFIG_FILE_H_
