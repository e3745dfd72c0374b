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
        buffer_.clear();
    }
    [[noreturn]] void fail() { throwWriteFailed(path_); }
    std::string path_, buffer_;
    FILE* file_;
};

inline Vec3 vertexColor(const MeshObject& o, size_t v) {
    return o.vertexColors.empty() ? o.color : o.vertexColors[v];
}
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
void writeObj(const std::string& path, const std::vector<MeshObject>& objects, bool materialFile);
void writePly(const std::string& path, const std::vector<MeshObject>& objects);
void writeStl(const std::string& path, const std::vector<MeshObject>& objects);
void writeOff(const std::string& path, const std::vector<MeshObject>& objects);
void writeGlb(const std::string& path, const std::vector<MeshObject>& objects, double metresPerUnit);
void write3mf(const std::string& path, const std::vector<MeshObject>& objects, double metresPerUnit);
void writeUsda(const std::string& path, const std::vector<MeshObject>& objects, const MeshFileOptions& options);

}  // namespace pavel
