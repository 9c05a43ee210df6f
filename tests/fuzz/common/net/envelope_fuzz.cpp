// Any bytes as a stream of frames (F1, F2): the first byte says how it is cut into reads. Memory stays within
// the limit, and every message that is accepted can be sent again and reads the same.

#include <cstdlib>
#include <span>

#include "common/net/framing.h"
#include "proto/session.pb.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace handloft;
  constexpr std::uint32_t limit = 1u << 16;
  if (size == 0) return 0;
  const std::size_t piece = std::size_t{data[0]} + 1;
  std::span<const std::uint8_t> rest(data + 1, size - 1);
  net::FrameDecoder decoder(limit);
  v1::Envelope envelope, again;
  while (!rest.empty()) {
    const std::size_t count = std::min(piece, rest.size());
    decoder.append(rest.first(count));
    rest = rest.subspan(count);
    for (;;) {
      const auto payload = decoder.next();
      if (!payload) return 0;
      if (!*payload) break;
      if ((*payload)->size() > limit) std::abort();
      if (!net::parse_envelope(**payload, envelope)) continue;
      const auto frame = net::encode_frame(envelope);
      if (!frame) std::abort();
      const auto* bytes = reinterpret_cast<const std::uint8_t*>((*frame)->data());
      if (!net::parse_envelope({bytes + net::frame_header_bytes, (*frame)->size() - net::frame_header_bytes},
                               again)) {
        std::abort();
      }
    }
    if (decoder.capacity() > 4 * std::size_t{limit}) std::abort();
  }
  return 0;
}
