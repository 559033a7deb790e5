#pragma once
#include <filesystem>
#include <stdexcept>
#include <string>

namespace scanview {

/// Why something failed; the value is the exit code of the command (DESIGN: "The command").
enum class ErrorCode { usage = 2, bad_input = 3, no_solution = 4, io = 5, partial = 6, interrupted = 130 };

/// Bad input or a bad environment. Expected numerical outcomes (no overlap, not converged) are values in results,
/// never errors. `what()` is one line, "path: message" or just the message where no file is concerned.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, std::filesystem::path path, std::string const& message);
  ErrorCode code() const { return code_; }
  std::filesystem::path const& path() const { return path_; }
  std::string const& message() const { return message_; }

 private:
  ErrorCode code_;
  std::filesystem::path path_;
  std::string message_;
};

}  // namespace scanview
