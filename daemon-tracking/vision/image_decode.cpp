#include "daemon-tracking/vision/image_decode.h"

#include <fmt/core.h>
#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "daemon-tracking/vision/camera_model.h"

namespace handloft::tracking {

namespace {

// A picture of the smallest kind still has its tables; a larger one is no webcam's.
constexpr std::size_t min_jpeg_bytes = 100;
constexpr std::size_t max_jpeg_bytes = 64u << 20;

void shape(Plane& plane, int width, int height) {
  plane.width_px = width;
  plane.height_px = height;
  plane.samples.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
}

void clear(Plane& plane) {
  shape(plane, 0, 0);
}

Error corrupt(std::string message) {
  return make_error(ErrorCode::data_corrupt, std::move(message), "frame.bytes");
}

}  // namespace

struct FrameDecoder::Handle {
  Handle() : jpeg(tjInitDecompress()) {}
  ~Handle() {
    if (jpeg != nullptr) tjDestroy(jpeg);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  tjhandle jpeg;
};

FrameDecoder::FrameDecoder() : handle_(std::make_unique<Handle>()) {}
FrameDecoder::~FrameDecoder() = default;
FrameDecoder::FrameDecoder(FrameDecoder&&) noexcept = default;
FrameDecoder& FrameDecoder::operator=(FrameDecoder&&) noexcept = default;

Result<const PlanarImage*> FrameDecoder::decode(const CameraFrame& frame, DecodePlanes planes) {
  if (frame.width_px < 1 || frame.height_px < 1 || frame.width_px > max_image_side_px ||
      frame.height_px > max_image_side_px)
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} x {} pixels, expected sides of 1..{}", frame.width_px,
                                  frame.height_px, max_image_side_px),
                      "frame.size");
  if (!frame.bytes) return corrupt("found no bytes, expected a picture");
  Status status;
  switch (frame.format) {
    case PixelFormat::mjpeg:
      status = decode_jpeg(frame, planes);
      break;
    case PixelFormat::yuyv:
      status = decode_yuyv(frame, planes);
      break;
    case PixelFormat::grey:
      status = decode_grey(frame);
      break;
    default:
      return make_error(
          ErrorCode::unsupported,
          fmt::format("found {}, expected 1 (MJPEG), 2 (YUYV) or 3 (GREY)", static_cast<int>(frame.format)),
          "frame.format");
  }
  if (!status) {
    // After a broken header the decompressor stays in the middle of it and would refuse every later frame
    // too.
    if (frame.format == PixelFormat::mjpeg) handle_ = std::make_unique<Handle>();
    return status.error();
  }
  return &image_;
}

Status FrameDecoder::decode_jpeg(const CameraFrame& frame, DecodePlanes planes) {
  const auto& bytes = *frame.bytes;
  if (handle_->jpeg == nullptr) return make_error(ErrorCode::internal, "libturbojpeg gave no decompressor");
  if (bytes.size() < min_jpeg_bytes || bytes.size() > max_jpeg_bytes)
    return corrupt(
        fmt::format("found {} bytes, expected {}..{}", bytes.size(), min_jpeg_bytes, max_jpeg_bytes));
  if (bytes[0] != 0xFF || bytes[1] != 0xD8) return corrupt("found no start-of-image marker");
  // A truncated picture is routine on USB and decodes to half a picture and grey: refused. Drivers pad the
  // end.
  std::size_t end = bytes.size();
  while (end > 2 && bytes[end - 1] == 0x00) --end;
  if (bytes[end - 2] != 0xFF || bytes[end - 1] != 0xD9)
    return corrupt("found no end-of-image marker: truncated");

  int width = 0, height = 0, subsampling = 0, colourspace = 0;
  if (tjDecompressHeader3(handle_->jpeg, bytes.data(), static_cast<unsigned long>(end), &width, &height,
                          &subsampling, &colourspace) != 0)
    return corrupt(fmt::format("JPEG header: {}", tjGetErrorStr2(handle_->jpeg)));
  if (width != frame.width_px || height != frame.height_px)
    return corrupt(fmt::format("found a JPEG of {} x {}, expected {} x {}", width, height, frame.width_px,
                               frame.height_px));
  const bool grey = colourspace == TJCS_GRAY;
  if (!grey && colourspace != TJCS_YCbCr)
    return make_error(ErrorCode::unsupported,
                      fmt::format("found JPEG colour space {}, expected grey or YCbCr", colourspace),
                      "frame.bytes");
  if (subsampling < 0 || subsampling >= TJ_NUMSAMP)
    return make_error(ErrorCode::unsupported, fmt::format("found JPEG subsampling {}", subsampling),
                      "frame.bytes");

  // The accurate inverse DCT is libjpeg's default; the fast one has known faults with scaled chroma.
  constexpr int flags = TJFLAG_ACCURATEDCT | TJFLAG_STOPONWARNING;
  if (grey || planes == DecodePlanes::luma) {
    shape(image_.y, width, height);
    clear(image_.cb);
    clear(image_.cr);
    if (tjDecompress2(handle_->jpeg, bytes.data(), static_cast<unsigned long>(end), image_.y.samples.data(),
                      width, 0, height, TJPF_GRAY, flags) != 0)
      return corrupt(fmt::format("JPEG: {}", tjGetErrorStr2(handle_->jpeg)));
    return {};
  }
  const std::array<Plane*, 3> targets{&image_.y, &image_.cb, &image_.cr};
  std::array<unsigned char*, 3> pointers{};
  for (int component = 0; component < 3; ++component) {
    const int plane_width = tjPlaneWidth(component, width, subsampling);
    const int plane_height = tjPlaneHeight(component, height, subsampling);
    if (plane_width < 1 || plane_height < 1 || plane_width > 2 * max_image_side_px ||
        plane_height > 2 * max_image_side_px)
      return corrupt("found a plane without size");
    Plane& plane = *targets[static_cast<std::size_t>(component)];
    shape(plane, plane_width, plane_height);
    pointers[static_cast<std::size_t>(component)] = plane.samples.data();
  }
  image_.chroma_step_x = tjMCUWidth[subsampling] / 8;
  image_.chroma_step_y = tjMCUHeight[subsampling] / 8;
  if (tjDecompressToYUVPlanes(handle_->jpeg, bytes.data(), static_cast<unsigned long>(end), pointers.data(),
                              width, nullptr, height, flags) != 0)
    return corrupt(fmt::format("JPEG: {}", tjGetErrorStr2(handle_->jpeg)));
  if (image_.y.width_px != width || image_.y.height_px != height) {
    // Planes are padded to the chroma's multiple; luma is cut back to the picture.
    for (int row = 1; row < height; ++row)
      std::memmove(image_.y.samples.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width),
                   image_.y.samples.data() +
                       static_cast<std::size_t>(row) * static_cast<std::size_t>(image_.y.width_px),
                   static_cast<std::size_t>(width));
    shape(image_.y, width, height);
  }
  return {};
}

Status FrameDecoder::decode_yuyv(const CameraFrame& frame, DecodePlanes planes) {
  const int width = frame.width_px, height = frame.height_px;
  if (width % 2 != 0)
    return make_error(ErrorCode::invalid_argument, fmt::format("found width {}, expected an even one", width),
                      "frame.size");
  const auto& bytes = *frame.bytes;
  const std::size_t expected = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 2;
  if (bytes.size() < expected)
    return corrupt(fmt::format("found {} bytes, expected {}", bytes.size(), expected));
  shape(image_.y, width, height);
  for (std::size_t i = 0; i < image_.y.samples.size(); ++i) image_.y.samples[i] = bytes[2 * i];
  if (planes == DecodePlanes::luma) {
    clear(image_.cb);
    clear(image_.cr);
    return {};
  }
  shape(image_.cb, width / 2, height);
  shape(image_.cr, width / 2, height);
  image_.chroma_step_x = 2;
  image_.chroma_step_y = 1;
  for (std::size_t i = 0; i < image_.cb.samples.size(); ++i) {
    image_.cb.samples[i] = bytes[4 * i + 1];
    image_.cr.samples[i] = bytes[4 * i + 3];
  }
  return {};
}

Status FrameDecoder::decode_grey(const CameraFrame& frame) {
  const auto& bytes = *frame.bytes;
  shape(image_.y, frame.width_px, frame.height_px);
  clear(image_.cb);
  clear(image_.cr);
  if (bytes.size() < image_.y.samples.size()) {
    const std::size_t expected = image_.y.samples.size();
    clear(image_.y);
    return corrupt(fmt::format("found {} bytes, expected {}", bytes.size(), expected));
  }
  std::copy_n(bytes.begin(), image_.y.samples.size(), image_.y.samples.begin());
  return {};
}

}  // namespace handloft::tracking
