// A frame of the film ring whose head says one thing and whose bytes another, in every format: decoded to as
// many bytes as the head says, or refused; bombs are refused by their size. Bytes 0 to 4: format, width and
// height (16 bits each, little-endian); the rest is the picture.

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "client-hmd/view/film_feed.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace handloft;
  constexpr std::size_t header = 5;
  if (size < header) return 0;
  net::VideoFrame frame;
  frame.info.format = static_cast<net::VideoFormat>(data[0] % 6);
  frame.info.width_px = data[1] + 256U * data[2];
  frame.info.height_px = data[3] + 256U * data[4];
  frame.bytes.assign(data + header, data + size);
  const std::size_t pixels = std::size_t{frame.info.width_px} * frame.info.height_px;
  const auto rgba = client::decode_picture(frame);
  if (rgba && rgba->size() != 4 * pixels) std::abort();
  if (rgba && pixels > (std::size_t{1} << 24)) std::abort();
  return 0;
}
