#pragma once
// A heap that the program keeps within a limit of memory, by leaving the rest on disk.
//
// Once enabled, every larger allocation of the process (operator new; voxels, fronts, meshes) comes from a file that is
// mapped into memory. A thread watches the resident set, and where it nears the limit, drops pages in turn: they stay
// in the file, and come back when they are touched. Elements are worked through in order of place, so what is dropped
// is seldom asked for soon. Results cannot depend on it.
#include <cstddef>
#include <string>

namespace pavel {

/// @throws InputError for a limit that enablePagedHeap would not take
void checkMemoryLimit(size_t limit);

/// To be called once, before work starts.
/// @param limit bytes of memory that the process may hold; kept but for a few per cent, and for allocations below a KB
/// @param folder where the file is made; it has no name there and vanishes with the process
/// @throws InputError for a limit that is too low; RunError where the file cannot be made
void enablePagedHeap(size_t limit, const std::string& folder);

}  // namespace pavel
