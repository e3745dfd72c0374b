#include "pavel/io/atomic_output.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "pavel/core/error.h"

namespace pavel {
namespace fs = std::filesystem;

AtomicOutput::AtomicOutput(std::string target, bool folder, bool force) : target_(std::move(target)) {
    while (target_.size() > 1 && target_.back() == '/') target_.pop_back();
    const fs::path path(target_);
    std::error_code error;
    const bool occupied =
        folder && fs::is_directory(path, error) ? !fs::is_empty(path, error) : fs::exists(path, error);
    if (occupied && !force)
        throw InputError(target_ + ": exists already; choose another place, or overwrite it with --force");
    if (occupied && folder && fs::is_directory(path, error) && !fs::exists(path / "report.json", error) &&
        !fs::exists(path / "seeds.json", error) && !fs::exists(path / "scene.json", error) &&
        !fs::exists(path / "tables.json", error))
        throw InputError(target_ + ": holds other files than a result of this program; it is not overwritten");
    const fs::path parent = path.has_parent_path() ? path.parent_path() : fs::path(".");
    if (!fs::is_directory(parent, error)) throw InputError(parent.string() + ": no such folder for the output");
    std::string name = (parent / ("." + path.filename().string() + ".XXXXXX")).string();
    if (folder) {
        if (!mkdtemp(name.data())) throw InputError(parent.string() + ": cannot be written to");
        fs::permissions(name,
                        fs::perms::owner_all | fs::perms::group_read | fs::perms::group_exec | fs::perms::others_read |
                            fs::perms::others_exec,
                        error);
    } else {
        // The ending decides how a file is written, so it stays.
        name += path.extension().string();
        const int fd = mkstemps(name.data(), int(path.extension().string().size()));
        if (fd < 0) throw InputError(parent.string() + ": cannot be written to");
        close(fd);
        fs::permissions(name,
                        fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read | fs::perms::others_read,
                        error);
    }
    place_ = name;
}

AtomicOutput::~AtomicOutput() {
    std::error_code error;
    if (!committed_) fs::remove_all(place_, error);
}

void AtomicOutput::commit() {
    std::error_code error;
    const fs::path target(target_);
    if (fs::is_directory(target, error)) {
        // Swap, so that the old result stays until the new one is in place.
        const std::string old = place_ + ".old";
        fs::rename(target, old, error);
        if (!error) fs::rename(place_, target, error);
        if (error) throw RunError(target_ + ": cannot be replaced (" + error.message() + ")");
        fs::remove_all(old, error);
    } else {
        fs::rename(place_, target, error);
        if (error) throw RunError(target_ + ": cannot be written (" + error.message() + ")");
    }
    committed_ = true;
}

void writeText(const std::string& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.flush();
    if (!file) throw RunError(path + ": writing failed (is the disk full?)");
}

}  // namespace pavel
