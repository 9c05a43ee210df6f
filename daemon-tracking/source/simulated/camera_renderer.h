#pragma once
// Renders what one camera of the rig sees: table, tags, head rig and hand, through its lens, with exposure,
// blur and noise, as the bytes of a JPEG. What stands still is drawn once; the head's camera warps a picture
// of the table instead.

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/source/simulated/hand_program.h"
#include "daemon-tracking/source/simulated/image_options.h"
#include "daemon-tracking/source/simulated/image_planes.h"
#include "daemon-tracking/source/simulated/painter.h"
#include "daemon-tracking/source/simulated/table_scene.h"

namespace handloft::tracking {

/// The scene over one exposure: in the middle of its first, second and last third.
struct Exposure {
  HandState begin, middle, end;
  Eigen::Isometry3d world_from_head = Eigen::Isometry3d::Identity();
};

class CameraRenderer {
 public:
  /// Takes about 0.2 s for a table camera: it draws its background. `camera` indexes rig.cameras.
  CameraRenderer(const Rig& rig, std::size_t camera, const ImageOptions& options);

  /// The scene so many seconds after the frame's time: what a rolling shutter's later rows see.
  using ExposureAfter = std::function<Exposure(double delay_s)>;

  /// The picture as JPEG; `noise_key` makes the noise.
  Result<std::vector<std::uint8_t>> render(const ExposureAfter& exposure, std::uint64_t noise_key);
  Result<std::vector<std::uint8_t>> render(const Exposure& exposure, std::uint64_t noise_key);

  /// The same before it is compressed, and of a scene that stands still between rows. Valid until the next
  /// call.
  const ImagePlanes& draw(const ExposureAfter& exposure, std::uint64_t noise_key);
  const ImagePlanes& draw(const Exposure& exposure, std::uint64_t noise_key);

  Eigen::Isometry3d world_from_camera(const Eigen::Isometry3d& world_from_head) const;
  const Lens& lens() const { return painter_.lens(); }

 private:
  struct HeadTag {
    TagPlacement placement;
    TagBitmap bitmap;
  };
  void draw_background();
  void blur_background();
  void draw_rows(const Exposure& exposure, const Rows& rows);
  void warp_table(const Eigen::Isometry3d& world_from_camera, const Rows& rows);
  void draw_head(const Eigen::Isometry3d& camera_from_head, const Rows& rows);
  void draw_tag(const HeadTag& tag, const Eigen::Isometry3d& camera_from_head, const Rows& rows);
  void draw_hand(const Exposure& exposure, const Eigen::Isometry3d& camera_from_world, const Rows& rows);
  void scale_brightness();

  Rig rig_;
  CameraCalibration camera_;
  ImageOptions options_;
  Painter painter_;
  SensorNoise noise_;
  JpegEncoder encoder_;
  TableScene scene_;
  TableScene::Texture texture_;  ///< Head camera only.
  ImagePlanes background_;       ///< Table cameras only.
  ImagePlanes image_;
  std::vector<HeadTag> head_tags_;
};

}  // namespace handloft::tracking
