#pragma once
// Strict reading of JSON objects: every key is known, every value has its type, and errors name the key's path.
#include <nlohmann/json.hpp>
#include <set>

#include "pavel/core/error.h"
#include "pavel/core/shapes.h"

namespace pavel {

class JsonReader {
  public:
    JsonReader(const nlohmann::json& object, std::string path) : object_(object), path_(std::move(path)) {
        if (!object.is_object()) fail("must be an object { ... }");
    }
    /// Call once all keys have been asked for: the rest are unknown.
    void finish() const {
        for (const auto& item : object_.items())
            if (!asked_.count(item.key()))
                throw InputError(path_ + (path_.empty() || path_.back() == ' ' ? "" : ".") + item.key() +
                                 ": unknown key" +
                                 didYouMean(item.key(), std::vector<std::string>(asked_.begin(), asked_.end())));
    }
    const nlohmann::json* find(const std::string& key) {
        asked_.insert(key);
        const auto it = object_.find(key);
        return it == object_.end() ? nullptr : &*it;
    }
    bool has(const std::string& key) const { return object_.contains(key); }
    template <class T>
    void get(const std::string& key, T& value) {
        if (const auto* j = find(key)) value = as<T>(*j, at(key));
    }
    template <class T>
    void get(const std::string& key, std::optional<T>& value) {
        if (const auto* j = find(key)) value = as<T>(*j, at(key));
    }
    /// One of a few words; `later` are refused as not available yet.
    void choice(const std::string& key, std::string& value, const std::vector<std::string>& now,
                const std::vector<std::string>& later = {}) {
        const auto* j = find(key);
        if (!j) return;
        value = as<std::string>(*j, at(key));
        for (const std::string& w : later)
            if (w == value) throw InputError(at(key) + ": \"" + value + "\" is not available yet");
        for (const std::string& w : now)
            if (w == value) return;
        std::string list;
        for (const std::string& w : now) list += (list.empty() ? "" : ", ") + w;
        throw InputError(at(key) + ": \"" + value + "\" is unknown; use one of " + list + didYouMean(value, now));
    }
    std::string at(const std::string& key) const {
        return path_ + (path_.empty() || path_.back() == ' ' ? "" : ".") + key;
    }

    template <class T>
    static T as(const nlohmann::json& j, const std::string& where) {
        if constexpr (std::is_same_v<T, bool>) {
            if (!j.is_boolean()) throw InputError(where + ": must be true or false");
            return j.get<bool>();
        } else if constexpr (std::is_integral_v<T>) {
            if (!j.is_number_integer() || j.get<double>() < 0)
                throw InputError(where + ": must be a whole number, 0 or more");
            return j.get<T>();
        } else if constexpr (std::is_floating_point_v<T>) {
            if (!j.is_number()) throw InputError(where + ": must be a number");
            return j.get<T>();
        } else if constexpr (std::is_same_v<T, std::string>) {
            if (!j.is_string()) throw InputError(where + ": must be a text in quotes");
            return j.get<std::string>();
        } else {
            static_assert(std::is_same_v<T, Vec3>);
            if (!j.is_array() || j.size() != 3 || !j[0].is_number() || !j[1].is_number() || !j[2].is_number())
                throw InputError(where + ": must be three numbers [x, y, z]");
            return Vec3(j[0].get<double>(), j[1].get<double>(), j[2].get<double>());
        }
    }

  private:
    [[noreturn]] void fail(const std::string& what) const {
        throw InputError((path_.empty() ? "the scene" : path_) + ": " + what);
    }
    const nlohmann::json& object_;
    std::string path_;
    std::set<std::string> asked_;
};

}  // namespace pavel
