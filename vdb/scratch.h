#pragma once
// Large arrays that live shortly.
#include <vector>

namespace pavel {

/// An array of floats whose memory the thread keeps for the next one: the system would have to clear new pages for
/// every element, and small things would settle in the gap.
class Scratch {
  public:
    Scratch() {
        if (spares().empty()) return;
        values_ = std::move(spares().back());
        spares().pop_back();
    }
    Scratch(Scratch&&) = default;
    ~Scratch() {
        constexpr size_t kMostSpares = 8;
        if (values_.capacity() == 0 || spares().size() >= kMostSpares) return;
        values_.clear();
        spares().push_back(std::move(values_));
    }
    std::vector<float>& operator*() { return values_; }
    const std::vector<float>& operator*() const { return values_; }
    std::vector<float>* operator->() { return &values_; }
    const std::vector<float>* operator->() const { return &values_; }

  private:
    static std::vector<std::vector<float>>& spares() {
        static thread_local std::vector<std::vector<float>> of;
        return of;
    }
    std::vector<float> values_;
};

}  // namespace pavel
