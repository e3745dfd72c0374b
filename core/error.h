#pragma once
// The one family of exceptions that public functions throw; the program maps each to its exit status.
#include <stdexcept>
#include <string>

namespace pavel {

/// Base of every exception thrown by Pavel's libraries.
class Error : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
    /// Exit status of the program when this reaches main.
    virtual int exitStatus() const { return 1; }
};

/// Bad usage, scene or input file. The message names the file, key or line, and the mend.
class InputError : public Error {
  public:
    using Error::Error;
    int exitStatus() const override { return 2; }
};

/// A run that could not be finished: I/O, memory, internal.
class RunError : public Error {
  public:
    using Error::Error;
};

/// The user asked to stop.
class Interrupted : public Error {
  public:
    Interrupted() : Error("interrupted") {}
    int exitStatus() const override { return 130; }
};

}  // namespace pavel
