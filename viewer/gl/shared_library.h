#pragma once
#include <string>

namespace scanview {

/// A library opened at run time with its names kept to itself (RTLD_LOCAL): OpenGL implementations in one process must
/// not see each other's functions. `loaded()` is false where it is not installed.
class SharedLibrary {
 public:
  explicit SharedLibrary(char const* name);
  ~SharedLibrary();
  SharedLibrary(SharedLibrary const&) = delete;
  SharedLibrary& operator=(SharedLibrary const&) = delete;
  bool loaded() const { return handle_ != nullptr; }
  void* find(char const* symbol) const;
  /// A function by its type; throws Error{io} naming library and symbol where it is missing.
  template <typename Function>
  Function get(char const* symbol) const {
    return reinterpret_cast<Function>(require(symbol));
  }

 private:
  void* require(char const* symbol) const;
  std::string name_;
  void* handle_ = nullptr;
};

}  // namespace scanview
