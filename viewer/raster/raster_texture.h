#pragma once
#include "viewer/raster/raster_types.h"
#include "viewer/view_based/picture_pyramid.h"

namespace scanview {

/// A view's picture in the form that the kernels sample.
RasterTexture raster_texture(PicturePyramid const& pyramid);

}  // namespace scanview
