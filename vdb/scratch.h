#pragma once
// Memory of what lives shortly: large arrays, and many objects of a kind.
#include <memory>
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

/// Objects of one type that come and go by the thousand: a thread keeps those that go for those to come.
template <class T>
class Spares {
  public:
    /// One that may hold anything, or a new one.
    static std::unique_ptr<T> take() {
        if (kept().empty()) return std::unique_ptr<T>(new T);
        std::unique_ptr<T> one = std::move(kept().back());
        kept().pop_back();
        return one;
    }
    static void keep(std::unique_ptr<T> one) {
        constexpr size_t kMost = 2048;
        if (one && kept().size() < kMost) kept().push_back(std::move(one));
    }

  private:
    static std::vector<std::unique_ptr<T>>& kept() {
        static thread_local std::vector<std::unique_ptr<T>> of;
        return of;
    }
};

}  // namespace pavel
