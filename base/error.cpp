#include "base/error.h"

namespace scanview {

Error::Error(ErrorCode code, std::filesystem::path path, std::string const& message)
    : std::runtime_error(path.empty() ? message : path.string() + ": " + message),
      code_(code),
      path_(std::move(path)),
      message_(message) {}

}  // namespace scanview
