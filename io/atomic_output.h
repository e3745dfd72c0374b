#pragma once
#include <string>

namespace pavel {

/// A folder (or file) that exists whole or not at all: work goes to a temporary place beside it and is renamed at the
/// end.
class AtomicOutput {
  public:
    /// @param folder make a folder at the temporary place
    /// @throws InputError where `target` exists and `force` is not set, or its parent is missing or cannot be written
    AtomicOutput(std::string target, bool folder, bool force);
    ~AtomicOutput();  ///< removes the temporary place unless committed
    AtomicOutput(const AtomicOutput&) = delete;
    AtomicOutput& operator=(const AtomicOutput&) = delete;
    const std::string& place() const { return place_; }
    std::string place(const std::string& file) const { return place_ + "/" + file; }
    void commit();

  private:
    std::string target_, place_;
    bool committed_ = false;
};

/// Writes a small text file. Throws RunError.
void writeText(const std::string& path, const std::string& text);

}  // namespace pavel
