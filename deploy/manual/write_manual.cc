// Writes the manual pages of both programs into a folder: write_manual FOLDER. Run by the build.
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "deploy/manual/programs.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: write_manual FOLDER\n";
    return 2;
  }
  std::vector<locus::manual::Page> pages = locus::manual::pages_of_locus();
  for (locus::manual::Page& page : locus::manual::pages_of_locusd()) pages.push_back(page);
  for (const locus::manual::Page& page : pages) {
    const std::string path = std::string(argv[1]) + "/" + page.file;
    std::ofstream file(path, std::ios::trunc);
    file << page.roff;
    file.close();
    if (!file) {
      std::cerr << "write_manual: cannot write " << path << "\n";
      return 1;
    }
  }
  return 0;
}
