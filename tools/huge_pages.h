#pragma once

namespace pavel {

/// Starts the process anew, once, so that malloc asks for huge pages: packing writes most of its memory once, and the
/// page faults of that are up to a tenth of its time. glibc takes this from the environment alone, and before main.
/// Does nothing where the environment tunes glibc already, or the kernel gives huge pages without being asked, or not
/// at all. To be called before anything is written, or a thread started.
void useHugePages(char** argv);

}  // namespace pavel
