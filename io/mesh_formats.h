#pragma once
// Internal: the writers of single formats, and what they share.
#include <algorithm>
#include <cstdio>
#include <string>

#include "pavel/core/error.h"
#include "pavel/io/mesh_write.h"

namespace pavel {

[[noreturn]] inline void throwWriteFailed(const std::string& path) {
    throw RunError(path + ": writing failed (is the disk full?)");
}

/// Buffered file that reports every failure (a full disk shows on flush).
class Output {
  public:
    explicit Output(const std::string& path) : path_(path), file_(std::fopen(path.c_str(), "wb")) {
        if (!file_) throw RunError(path + ": cannot be written");
        buffer_.reserve(kFlush + 4096);
    }
    ~Output() {
        if (file_) std::fclose(file_);
    }
    Output(const Output&) = delete;
    Output& operator=(const Output&) = delete;
    template <class... A>
    void print(const char* format, A... values) {
        char line[256];
        const int n = std::snprintf(line, sizeof line, format, values...);
        bytes(line, size_t(n));
    }
    void text(const std::string& s) { bytes(s.data(), s.size()); }
    void bytes(const void* data, size_t n) {
        buffer_.append(static_cast<const char*>(data), n);
        if (buffer_.size() >= kFlush) flush();
    }
    template <class T>
    void raw(T value) {
        bytes(&value, sizeof value);
    }
    uint64_t size() const { return flushed_ + buffer_.size(); }
    /// Puts other bytes in the place of some that were written.
    void patch(long at, const void* data, size_t n) {
        flush();
        if (std::fseek(file_, at, SEEK_SET) != 0 || std::fwrite(data, 1, n, file_) != n ||
            std::fseek(file_, 0, SEEK_END) != 0)
            fail();
    }
    void close() {
        flush();
        const bool ok = std::fclose(file_) == 0;
        file_ = nullptr;
        if (!ok) fail();
    }

  private:
    static constexpr size_t kFlush = size_t(1) << 20;
    void flush() {
        if (std::fwrite(buffer_.data(), 1, buffer_.size(), file_) != buffer_.size()) fail();
        flushed_ += buffer_.size();
        buffer_.clear();
    }
    [[noreturn]] void fail() { throwWriteFailed(path_); }
    std::string path_, buffer_;
    FILE* file_;
    uint64_t flushed_ = 0;
};

/// A part of a file that waits beside it until its place is known.
struct WaitingPart {
    WaitingPart(const std::string& file, const char* name) : path(file + "." + name), out(path) {}
    ~WaitingPart() { std::remove(path.c_str()); }
    /// Moves it to the end of a file.
    void appendTo(Output& file) {
        out.close();
        const std::unique_ptr<FILE, int (*)(FILE*)> in(std::fopen(path.c_str(), "rb"), &std::fclose);
        std::vector<char> piece(size_t(1) << 20);
        uint64_t left = out.size();
        while (in && left > 0) {
            const size_t n = std::fread(piece.data(), 1, std::min<uint64_t>(piece.size(), left), in.get());
            if (n == 0) break;
            file.bytes(piece.data(), n);
            left -= n;
        }
        if (left > 0) throw RunError(path + ": cannot be read back");
        std::remove(path.c_str());
    }

    std::string path;
    Output out;
};

inline uint8_t toByte(double c) {
    return uint8_t(std::lround(255 * std::clamp(c, 0.0, 1.0)));
}
inline double toLinear(double c) {
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

/// As given, or by the colour: rgb_d98c8c.
inline std::string materialName(const MeshObject& o) {
    char name[16];
    std::snprintf(name, sizeof name, "rgb_%02x%02x%02x", unsigned(toByte(o.color[0])), unsigned(toByte(o.color[1])),
                  unsigned(toByte(o.color[2])));
    return o.material.empty() ? name : o.material;
}
/// @param materialFile write NAME.mtl beside it, too
std::unique_ptr<MeshWriter> openObj(const std::string& path, bool materialFile);
std::unique_ptr<MeshWriter> openPly(const std::string& path);
std::unique_ptr<MeshWriter> openStl(const std::string& path);
std::unique_ptr<MeshWriter> openOff(const std::string& path);
std::unique_ptr<MeshWriter> openGlb(const std::string& path, double metresPerUnit);
std::unique_ptr<MeshWriter> open3mf(const std::string& path, double metresPerUnit);
std::unique_ptr<MeshWriter> openUsda(const std::string& path, const MeshFileOptions& options);

}  // namespace pavel
