#pragma once
#include <filesystem>

#include "base/html.h"

namespace scanview {

/// Keeps the section of a stage as report/ID.html inside the set.
void write_report_section(std::filesystem::path const& folder, ReportSection const& section);

/// Notes what a stage cost in timings.json, the only file besides report.html that may differ between equal runs.
void write_timing(std::filesystem::path const& folder, std::string const& stage, double seconds, double peak_mb,
                  int threads);

/// Puts report.html together from the kept sections, the stages' records and timings.json.
void write_report(std::filesystem::path const& folder);

}  // namespace scanview
