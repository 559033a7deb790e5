#include "viewer/window/keyframes.h"

namespace scanview {

Json Keyframes::to_json() const {
  Json json = {{"format", 1}, {"keyframes", Json::array()}, {"between", between}};
  for (auto const& key : cameras_) {
    json["keyframes"].push_back(
        {{"camera", key.camera.to_json()}, {"object_from_camera", pose_to_json(key.object_from_camera)}});
  }
  return json;
}

}  // namespace scanview
