#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace scanview {

/// A line of a text file, split at white space.
struct TextLine {
  std::size_t number;  ///< counted from 1, as editors do
  std::vector<std::string> words;
};

/// The lines of a file but those that start with '#'; a blank line has no words. Throws Error as read_file does.
std::vector<TextLine> read_text_lines(std::filesystem::path const& path);
/// The same without blank lines.
std::vector<TextLine> read_text_table(std::filesystem::path const& path);

/// A word as a number; "nan" and "inf" are numbers here, for the caller to judge. Throws Error{bad_input, path} naming
/// line and word.
double text_number(std::string const& word, std::filesystem::path const& path, std::size_t line);

}  // namespace scanview
