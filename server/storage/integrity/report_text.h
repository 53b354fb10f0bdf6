// Texts of the reports of check() and repair() for people, with one line for each scene and mesh. Free functions; any
// thread.
#ifndef LOCUS_SERVER_STORAGE_INTEGRITY_REPORT_TEXT_H_
#define LOCUS_SERVER_STORAGE_INTEGRITY_REPORT_TEXT_H_

#include <string>

#include "server/storage/integrity/check.h"
#include "server/storage/integrity/repair.h"

namespace locus::server {

std::string to_text(const DirectoryReport& report);
std::string to_text(const RepairReport& report);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_REPORT_TEXT_H_
