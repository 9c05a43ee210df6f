// However a stream is cut into pieces, the same frames come out.

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "common/net/framing.h"
#include "proto/session.pb.h"

namespace handloft::net {
namespace {

TEST(FramingProperty, FramesSurviveEveryWayOfCuttingTheStream) {
  EXPECT_TRUE(rc::check("cutting", [] {
    const auto texts = *rc::gen::container<std::vector<std::string>>(rc::gen::arbitrary<std::string>());
    const auto cuts = *rc::gen::container<std::vector<int>>(rc::gen::inRange(1, 40));
    std::string stream;
    for (const std::string& text : texts) {
      v1::Envelope envelope;
      envelope.mutable_join()->set_model("m" + std::to_string(text.size()));
      stream += **encode_frame(envelope);
    }
    FrameDecoder decoder;
    std::vector<std::string> found;
    std::size_t at = 0;
    for (std::size_t turn = 0; at < stream.size(); ++turn) {
      const std::size_t wanted =
          cuts.empty() ? stream.size() : static_cast<std::size_t>(cuts[turn % cuts.size()]);
      const std::size_t count = std::min(wanted, stream.size() - at);
      decoder.append({reinterpret_cast<const std::uint8_t*>(stream.data()) + at, count});
      at += count;
      for (;;) {
        const auto payload = decoder.next();
        RC_ASSERT(payload.ok());
        if (!*payload) break;
        v1::Envelope envelope;
        RC_ASSERT(parse_envelope(**payload, envelope).ok());
        found.push_back(envelope.join().model());
      }
    }
    RC_ASSERT(found.size() == texts.size());
    for (std::size_t i = 0; i < texts.size(); ++i)
      RC_ASSERT(found[i] == "m" + std::to_string(texts[i].size()));
    RC_ASSERT(!decoder.mid_frame());
  }));
}

TEST(FramingProperty, NoBytesMakeTheDecoderHoldMoreThanItsLimit) {
  EXPECT_TRUE(rc::check("bounded", [] {
    const auto limit = static_cast<std::uint32_t>(*rc::gen::inRange(0, 5000));
    const auto bytes = *rc::gen::container<std::vector<std::uint8_t>>(rc::gen::arbitrary<std::uint8_t>());
    FrameDecoder decoder(limit);
    for (int i = 0; i < 50; ++i) {
      decoder.append(bytes);
      for (auto payload = decoder.next(); payload.ok() && payload.value(); payload = decoder.next()) {
        RC_ASSERT(payload.value()->size() <= limit);
      }
      if (!decoder.next().ok()) break;
      RC_ASSERT(decoder.capacity() <= 2 * (limit + frame_header_bytes) + 2 * bytes.size() + (1u << 16));
    }
  }));
}

}  // namespace
}  // namespace handloft::net
