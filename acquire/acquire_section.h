#pragma once
#include <array>
#include <string>
#include <utility>

#include "acquire/acquire.h"
#include "base/html.h"

namespace scanview {

/// Why a pixel of a view has no depth, as reports call it.
inline constexpr std::array<std::pair<PixelClass, char const*>, 8> kWhyMissing = {{
    {PixelClass::no_light, "no_light"},
    {PixelClass::saturated, "saturated"},
    {PixelClass::several_peaks, "several_peaks"},
    {PixelClass::no_partner, "no_partner"},
    {PixelClass::inconsistent, "inconsistent"},
    {PixelClass::background, "background"},
    {PixelClass::cut, "cut"},
    {PixelClass::outlier, "outlier"},
}};

/// Pixels without a depth by reason, the keys of kWhyMissing and, where there are such pixels, "no_depth".
Json why_missing(RangeImage const& image);

/// Pictures of every view (colour, depth, class, sigma), why pixels are missing, and what was measured.
ReportSection acquire_section(AcquireResult const& result);

}  // namespace scanview
