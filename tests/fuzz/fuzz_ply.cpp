#include <cstddef>
#include <cstdint>

#include "base/error.h"
#include "base/ply.h"

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  try {
    scanview::parse_ply({reinterpret_cast<char const*>(data), size}, "fuzz.ply");
  } catch (scanview::Error const&) {
    // Refusing is one of the two right answers.
  }
  return 0;
}
