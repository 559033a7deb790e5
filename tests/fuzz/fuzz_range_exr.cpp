#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/files.h"

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  static auto const path =
      std::filesystem::temp_directory_path() / ("scanview_fuzz_" + std::to_string(::getpid()) + ".exr");
  scanview::write_file(path, {reinterpret_cast<char const*>(data), size});
  try {
    cv::Mat1f depth, sigma;
    scanview::read_range_exr(path, depth, sigma);
  } catch (scanview::Error const&) {
    // Refusing is one of the two right answers.
  }
  return 0;
}
