#include "pavel/tools/huge_pages.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace pavel {

void useHugePages(char** argv) {
    constexpr const char* kTunables = "GLIBC_TUNABLES";
    if (std::getenv(kTunables)) return;
    std::string modes;
    std::getline(std::ifstream("/sys/kernel/mm/transparent_hugepage/enabled"), modes);
    if (modes.find("[madvise]") == std::string::npos) return;
    // Under its own name, not as "exe".
    std::error_code failed;
    const std::string self = std::filesystem::read_symlink("/proc/self/exe", failed).string();
    if (failed || setenv(kTunables, "glibc.malloc.hugetlb=1", 1) != 0) return;
    execv(self.c_str(), argv);
    unsetenv(kTunables);  // it cannot be started: go on as it is
}

}  // namespace pavel
