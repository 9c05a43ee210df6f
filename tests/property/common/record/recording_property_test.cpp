// A recording cut or damaged anywhere gives a prefix of what was written, never anything else (D2, D4).

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <fstream>

#include "common/record/recording.h"
#include "tests/support/test_data.h"

namespace handloft::record {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(RecordingProperty, EveryCutAndEveryDamageLeavesAPrefix) {
  const test::TemporaryDirectory folder;
  const auto path = folder.path() / "a.rec";
  EXPECT_TRUE(rc::check("prefix", [&] {
    const auto payloads = *rc::gen::container<std::vector<Bytes>>(rc::gen::arbitrary<Bytes>());
    {
      const ManualClock clock;
      auto writer = RecordingWriter::create(path, {.program = "p", .started_at = "now", .more = {}}, clock);
      RC_ASSERT(writer.ok());
      for (const Bytes& payload : payloads) RC_ASSERT(writer->append(1, from_ns(0), payload).ok());
      RC_ASSERT(writer->finish().ok());
    }
    std::ifstream file(path, std::ios::binary);
    Bytes bytes(std::istreambuf_iterator<char>(file), {});
    bytes.resize(static_cast<std::size_t>(*rc::gen::inRange<int>(0, static_cast<int>(bytes.size()) + 1)));
    if (!bytes.empty() && *rc::gen::arbitrary<bool>()) {
      bytes[static_cast<std::size_t>(*rc::gen::inRange<int>(0, static_cast<int>(bytes.size())))] ^=
          static_cast<std::uint8_t>(*rc::gen::inRange(1, 256));
    }
    auto reader = RecordingReader::from_bytes(bytes, "test");
    if (!reader) return;
    std::size_t count = 0;
    for (auto record = reader->next(); record.ok() && record->has_value(); record = reader->next()) {
      RC_ASSERT(count < payloads.size());
      RC_ASSERT(std::ranges::equal((*record)->payload, payloads[count]));
      ++count;
    }
  }));
}

}  // namespace
}  // namespace handloft::record
