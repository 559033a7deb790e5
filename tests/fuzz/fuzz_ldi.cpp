#define XXH_INLINE_ALL
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "base/error.h"
#include "viewer/layered/ldi_file.h"
#include "viewer/layered/ldi_sums_coding.h"

namespace {

std::uint64_t number_at(std::string const& bytes, std::size_t at) {
  std::uint64_t number = 0;
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

/// What the hash of the header covers is made to fit (ldi_file.cpp), so that what is behind it is reached.
void make_hash_fit(std::string& bytes) {
  constexpr std::size_t kPrologue = 64, kHash = 16, kHashed = 24, kTextBytes = 24, kCells = 32, kCellBytes = 56;
  if (bytes.size() < kPrologue) return;
  std::uint64_t const text = std::min<std::uint64_t>(number_at(bytes, kTextBytes), bytes.size()),
                      cells = std::min<std::uint64_t>(number_at(bytes, kCells), bytes.size());
  std::size_t const end = std::min<std::size_t>(bytes.size(), (kPrologue + text + cells * kCellBytes + 63) / 64 * 64);
  std::uint64_t const hash = XXH3_64bits(bytes.data() + kHashed, end - kHashed);
  std::memcpy(bytes.data() + kHash, &hash, sizeof hash);
}

template <typename Read>
void attempt(Read const& read) {
  try {
    read();
  } catch (scanview::Error const&) {
    // Refusing is one of the two right answers.
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  static auto const path =
      std::filesystem::temp_directory_path() / ("scanview_fuzz_" + std::to_string(::getpid()) + ".ldi");
  std::string bytes(reinterpret_cast<char const*>(data), size);
  make_hash_fit(bytes);
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(size));
  attempt([&] {
    scanview::LdiTree const tree = scanview::read_ldi(path);
    for (scanview::LdiCell const& cell : tree.cells) tree.blocks(cell);
  });
  attempt([&] { scanview::read_ldi_builder(path); });
  attempt([&] {
    scanview::LdiOptions options;
    options.resolution = 8;
    scanview::decode_sums({reinterpret_cast<char const*>(data), size}, options, path);
  });
  return 0;
}
