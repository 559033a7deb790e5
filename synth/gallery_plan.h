#pragma once
#include "synth/patch_writer.h"

namespace scanview {

/// All that stands in the gallery (gallery.h), and its walls.
void write_gallery(PatchWriter& writer);

}  // namespace scanview
