// Writes the pages of both programs into a folder: write_manual [--markdown] FOLDER. Run by the build, and with
// --markdown by deploy/docs/build.sh.
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "deploy/manual/programs.h"

int main(int argc, char** argv) {
  const bool markdown = argc == 3 && std::string(argv[1]) == "--markdown";
  if (argc != 2 && !markdown) {
    std::cerr << "usage: write_manual [--markdown] FOLDER\n";
    return 2;
  }
  const locus::manual::Form form = markdown ? locus::manual::Form::kMarkdown : locus::manual::Form::kRoff;
  std::vector<locus::manual::Page> pages = locus::manual::pages_of_locus(form);
  for (locus::manual::Page& page : locus::manual::pages_of_locusd(form)) pages.push_back(page);
  for (const locus::manual::Page& page : pages) {
    const std::string path = std::string(argv[argc - 1]) + "/" + page.file;
    std::ofstream file(path, std::ios::trunc);
    file << page.text;
    file.close();
    if (!file) {
      std::cerr << "write_manual: cannot write " << path << "\n";
      return 1;
    }
  }
  return 0;
}
