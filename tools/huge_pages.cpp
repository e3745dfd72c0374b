#include "pavel/tools/huge_pages.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace pavel {

void useHugePages(char** argv) {
    constexpr const char* kTunables = "GLIBC_TUNABLES";
    // A thread's heap gets huge pages only where it is made at its full size, 64 MB, at once; setting that pad also
    // stops malloc from learning what to keep, so that is told, too.
    constexpr const char* kSettings =
        "glibc.malloc.hugetlb=1:glibc.malloc.top_pad=67108864:glibc.malloc.mmap_threshold=33554432:"
        "glibc.malloc.trim_threshold=134217728";
    if (std::getenv(kTunables)) return;
    std::string modes;
    std::getline(std::ifstream("/sys/kernel/mm/transparent_hugepage/enabled"), modes);
    if (modes.find("[madvise]") == std::string::npos) return;
    // Under its own name, not as "exe".
    std::error_code failed;
    const std::string self = std::filesystem::read_symlink("/proc/self/exe", failed).string();
    if (failed || setenv(kTunables, kSettings, 1) != 0) return;
    execv(self.c_str(), argv);
    unsetenv(kTunables);  // it cannot be started: go on as it is
}

}  // namespace pavel
