#include "pavel/tools/paged_heap.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <thread>

#include "pavel/core/error.h"

namespace {

constexpr size_t kChunk = size_t(1) << 20, kStep = 256, kSmall = size_t(32) << 10, kLeast = 1024;
constexpr size_t kMost = size_t(1) << 38;  // bytes of address space
constexpr int kSmallClasses = int(kSmall / kStep), kClasses = kSmallClasses + 24;

/// Blocks of one size: multiples of 256 bytes up to 32 KB, from there on powers of two.
struct SizeClass {
    std::atomic_flag busy = ATOMIC_FLAG_INIT;
    void** free = nullptr;  // kept apart: a list through the blocks would fetch them from disk when they are freed
    size_t freeCount = 0, freeRoom = 0;
    char *next = nullptr, *end = nullptr;
};

char* heap = nullptr;
size_t heapBytes = 0;
std::atomic<size_t> usedBytes{0};
std::atomic<bool> pressed{false};  // who allocates must wait
SizeClass classes[kClasses];
uint8_t classOfChunk[kMost / kChunk];

size_t sizeOf(int c) {
    return c < kSmallClasses ? size_t(c + 1) * kStep : (2 * kSmall) << (c - kSmallClasses);
}

int classOf(size_t bytes) {
    if (bytes <= kSmall) return int((bytes + kStep - 1) / kStep) - 1;
    int c = kSmallClasses;
    while (sizeOf(c) < bytes) ++c;
    return c;
}

char* newChunks(size_t bytes, int c) {
    const size_t at = usedBytes.fetch_add(bytes);
    if (at + bytes > heapBytes) {
        usedBytes.fetch_sub(bytes);
        return nullptr;
    }
    for (size_t k = at / kChunk; k < (at + bytes) / kChunk; ++k) classOfChunk[k] = uint8_t(c);
    return heap + at;
}

void* pagedAllocate(size_t bytes) {
    const int number = classOf(bytes);
    if (number >= kClasses) return nullptr;
    const size_t size = sizeOf(number);
    SizeClass& c = classes[number];
    while (c.busy.test_and_set(std::memory_order_acquire)) {
    }
    void* block = nullptr;
    if (c.freeCount > 0) {
        block = c.free[--c.freeCount];
    } else {
        if (c.next == c.end) {
            const size_t chunk = std::max(kChunk, size);
            c.next = newChunks(chunk, number);
            c.end = c.next ? c.next + chunk / size * size : nullptr;
        }
        block = c.next;
        if (block) c.next += size;
    }
    c.busy.clear(std::memory_order_release);
    return block;
}

bool isPaged(const void* p) {
    return heap && p >= heap && p < heap + heapBytes;
}

void pagedFree(void* p) {
    const int number = classOfChunk[size_t(static_cast<char*>(p) - heap) / kChunk];
    // Large blocks give their pages back, on disk, too.
    if (sizeOf(number) >= kChunk) madvise(p, sizeOf(number), MADV_REMOVE);
    SizeClass& c = classes[number];
    while (c.busy.test_and_set(std::memory_order_acquire)) {
    }
    if (c.freeCount == c.freeRoom) {
        const size_t room = std::max<size_t>(1024, 2 * c.freeRoom);
        if (void* list = std::realloc(c.free, room * sizeof(void*)))
            c.free = static_cast<void**>(list), c.freeRoom = room;
    }
    if (c.freeCount < c.freeRoom) c.free[c.freeCount++] = p;
    c.busy.clear(std::memory_order_release);
}

void* allocate(size_t bytes) {
    if (heap && bytes >= kLeast) {
        if (pressed.load(std::memory_order_relaxed)) std::this_thread::sleep_for(std::chrono::milliseconds(3));
        if (void* p = pagedAllocate(bytes)) return p;
    }
    return std::malloc(bytes ? bytes : 1);
}

void release(void* p) {
    if (isPaged(p))
        pagedFree(p);
    else
        std::free(p);
}

size_t residentBytes() {
    long size = 0, resident = 0;
    if (FILE* f = std::fopen("/proc/self/statm", "r")) {
        if (std::fscanf(f, "%ld %ld", &size, &resident) != 2) resident = 0;
        std::fclose(f);
    }
    return size_t(resident) * size_t(sysconf(_SC_PAGESIZE));
}

/// Drops pages from the heap, in turn, while the process holds too much.
[[noreturn]] void watch(size_t limit) {
    constexpr size_t kRun = size_t(4) << 20;
    // Pages come back in thousands within a tick of this thread, so it begins well below the limit.
    const size_t margin = std::max(limit / 8, std::min(limit / 2, size_t(400) << 20)), high = limit - margin,
                 low = high / 5 * 4;
    size_t hand = 0;
    for (;;) {
        const size_t resident = residentBytes();
        pressed.store(resident > high + margin / 2);
        if (resident > high) {
            const size_t used = usedBytes.load();
            for (size_t done = 0; done < used && residentBytes() > low; done += kRun) {
                if (hand >= used) hand = 0;
                madvise(heap + hand, std::min(kRun, used - hand), MADV_DONTNEED);
                hand += kRun;
            }
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
}

}  // namespace

namespace pavel {

void checkMemoryLimit(size_t limit) {
    constexpr size_t kLeastLimit = size_t(256) << 20;
    if (limit < kLeastLimit) throw InputError("--memory-limit: at least 256M is needed");
}

void enablePagedHeap(size_t limit, const std::string& folder) {
    checkMemoryLimit(limit);
    std::error_code error;
    const auto space = std::filesystem::space(folder, error);
    if (error) throw RunError(folder + ": " + error.message());
    std::string name = folder + "/.pavel-pages-XXXXXX";
    const int file = mkstemp(name.data());
    if (file < 0) throw RunError(folder + ": no file can be made there to page to");
    unlink(name.c_str());
    const size_t bytes = std::min(kMost, size_t(space.available) / kChunk * kChunk);
    void* p = ftruncate(file, off_t(bytes)) == 0
                  ? mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_NORESERVE, file, 0)
                  : MAP_FAILED;
    close(file);
    if (p == MAP_FAILED) throw RunError(folder + ": the file to page to cannot be mapped");
    heapBytes = bytes;
    heap = static_cast<char*>(p);
    std::thread(watch, limit).detach();
}

}  // namespace pavel

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
void* operator new(size_t bytes) {
    void* p = allocate(bytes);
    if (!p) throw std::bad_alloc();
    return p;
}
void* operator new[](size_t bytes) {
    return operator new(bytes);
}
void* operator new(size_t bytes, const std::nothrow_t&) noexcept {
    return allocate(bytes);
}
void* operator new[](size_t bytes, const std::nothrow_t&) noexcept {
    return allocate(bytes);
}
void operator delete(void* p) noexcept {
    release(p);
}
void operator delete[](void* p) noexcept {
    release(p);
}
void operator delete(void* p, size_t) noexcept {
    release(p);
}
void operator delete[](void* p, size_t) noexcept {
    release(p);
}
void operator delete(void* p, const std::nothrow_t&) noexcept {
    release(p);
}
void operator delete[](void* p, const std::nothrow_t&) noexcept {
    release(p);
}
#endif
