#include "viewer/gl/shared_library.h"

#include <dlfcn.h>

#include "base/error.h"

namespace scanview {

// NODELETE: graphics drivers leave thread-local destructors behind that must not be unmapped.
SharedLibrary::SharedLibrary(char const* name)
    : name_(name), handle_(dlopen(name, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE)) {}

SharedLibrary::~SharedLibrary() {
  if (handle_ != nullptr) dlclose(handle_);
}

void* SharedLibrary::find(char const* symbol) const { return handle_ == nullptr ? nullptr : dlsym(handle_, symbol); }

void* SharedLibrary::require(char const* symbol) const {
  void* const found = find(symbol);
  if (found == nullptr) throw Error(ErrorCode::io, {}, name_ + ": " + symbol + " is missing");
  return found;
}

}  // namespace scanview
