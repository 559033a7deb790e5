#include "cli/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>

#include "base/error.h"

namespace scanview {
namespace {

struct KeyValue {
  std::string stage, name, value;
};

KeyValue parse_setting(std::string const& text) {
  auto const equals = text.find('='), dot = text.find('.');
  if (equals == std::string::npos || dot == std::string::npos || dot > equals)
    throw Error(ErrorCode::usage, {}, fmt::format("--set {}: expected STAGE.NAME=VALUE", text));
  return {text.substr(0, dot), text.substr(dot + 1, equals - dot - 1), text.substr(equals + 1)};
}

template <typename T>
T parse_number(std::string const& text) {
  T value{};
  auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) throw std::invalid_argument("is no number");
  return value;
}

}  // namespace

void apply_settings(std::vector<std::string> const& settings, std::string const& stage,
                    std::vector<Setting> const& known) {
  for (auto const& text : settings) {
    auto const [of, name, value] = parse_setting(text);
    if (of != stage) continue;
    auto const it = std::find_if(known.begin(), known.end(), [&](Setting const& s) { return s.name == name; });
    if (it == known.end()) {
      std::string names;
      for (auto const& setting : known) names += " " + setting.name;
      throw Error(ErrorCode::usage, {}, fmt::format("--set {}: {} has no such setting; it has:{}", text, stage, names));
    }
    try {
      it->set(value);
    } catch (std::exception const& error) {
      throw Error(ErrorCode::usage, {}, fmt::format("--set {}: {}", text, error.what()));
    }
  }
}

void check_settings(std::vector<std::string> const& settings, std::vector<std::string> const& stages) {
  for (auto const& text : settings)
    if (std::find(stages.begin(), stages.end(), parse_setting(text).stage) == stages.end())
      throw Error(ErrorCode::usage, {}, fmt::format("--set {}: no such stage", text));
}

Setting number_setting(std::string name, double& value) {
  return {std::move(name), [&value](std::string const& text) { value = parse_number<double>(text); }};
}

Setting integer_setting(std::string name, int& value) {
  return {std::move(name), [&value](std::string const& text) { value = parse_number<int>(text); }};
}

double peak_memory_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024;
  return 0;
}

void reset_peak_memory() { std::ofstream("/proc/self/clear_refs") << "5"; }

}  // namespace scanview
