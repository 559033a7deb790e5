#include "acquire/text_table.h"

#include <fmt/format.h>

#include <charconv>
#include <sstream>

#include "base/error.h"
#include "base/files.h"

namespace scanview {

std::vector<TextLine> read_text_lines(std::filesystem::path const& path) {
  std::vector<TextLine> lines;
  std::istringstream text(read_file(path));
  std::size_t number = 0;
  for (std::string line; std::getline(text, line);) {
    TextLine entry{++number, {}};
    std::istringstream stream(line);
    for (std::string word; stream >> word;) entry.words.push_back(word);
    if (entry.words.empty() || !entry.words.front().starts_with('#')) lines.push_back(std::move(entry));
  }
  return lines;
}

std::vector<TextLine> read_text_table(std::filesystem::path const& path) {
  auto lines = read_text_lines(path);
  std::erase_if(lines, [](TextLine const& line) { return line.words.empty(); });
  return lines;
}

double text_number(std::string const& word, std::filesystem::path const& path, std::size_t line) {
  double value = 0;
  char const* const begin = word.data() + (word.starts_with('+') ? 1 : 0);
  auto const [end, problem] = std::from_chars(begin, word.data() + word.size(), value);
  if (problem != std::errc() || end != word.data() + word.size())
    throw Error(ErrorCode::bad_input, path, fmt::format("line {}: '{}' is no number", line, word.substr(0, 40)));
  return value;
}

}  // namespace scanview
