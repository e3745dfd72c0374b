#pragma once
// Other programs, run as a user would.
#include <sys/wait.h>

#include <cstdio>
#include <string>

namespace pavel::test {

struct Outcome {
    int status;
    std::string text;  ///< both output streams
};

inline Outcome runCommand(const std::string& command) {
    FILE* pipe = popen((command + " 2>&1").c_str(), "r");
    std::string text;
    char buffer[4096];
    while (const size_t n = fread(buffer, 1, sizeof buffer, pipe)) text.append(buffer, n);
    return {WEXITSTATUS(pclose(pipe)), text};
}

}  // namespace pavel::test
