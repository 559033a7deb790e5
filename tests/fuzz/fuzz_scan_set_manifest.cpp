#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/files.h"

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  static auto const folder = std::filesystem::temp_directory_path() / ("scanview_fuzz_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  scanview::write_file(folder / "scanset.json", {reinterpret_cast<char const*>(data), size});
  try {
    scanview::read_manifest(folder);
  } catch (scanview::Error const&) {
    // Refusing is one of the two right answers.
  }
  return 0;
}
