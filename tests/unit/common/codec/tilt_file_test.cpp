#include "common/codec/tilt_file.h"

#include <gtest/gtest.h>
#include <zip.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>

#include "tests/support/test_data.h"

namespace handloft::codec {
namespace {

/// Writes data.sketch as the format's description says, independently of the parser.
class SketchBuilder {
 public:
  template <typename T>
  SketchBuilder& put(T value) {
    const auto* bytes = reinterpret_cast<const std::byte*>(&value);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof(T));
    return *this;
  }
  SketchBuilder& header(std::int32_t strokes, std::int32_t version = 5) {
    return put<std::uint32_t>(0xc576a5cd)
        .put(version)
        .put<std::int32_t>(0)
        .put<std::uint32_t>(0)
        .put(strokes);
  }
  SketchBuilder& stroke(std::uint32_t stroke_mask, std::uint32_t point_mask) {
    put<std::int32_t>(7);
    for (const float c : {0.1F, 0.2F, 0.3F, 1.0F}) put(c);
    return put(0.5F).put(stroke_mask).put(point_mask);
  }
  SketchBuilder& point(float x, float y, float z) {
    for (const float v : {x, y, z, 0.0F, 0.0F, 0.0F, 1.0F}) put(v);
    return *this;
  }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

std::vector<std::byte> read_all(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  const std::vector<char> text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

/// A .tilt file around a sketch.
std::vector<std::byte> pack(const std::vector<std::byte>& sketch) {
  const test::TemporaryDirectory folder;
  const std::string path = (folder.path() / "archive").string();
  const zipFile zip = zipOpen(path.c_str(), APPEND_STATUS_CREATE);
  zipOpenNewFileInZip(zip, "data.sketch", nullptr, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED, 9);
  zipWriteInFileInZip(zip, sketch.data(), static_cast<unsigned>(sketch.size()));
  zipCloseFileInZip(zip);
  zipClose(zip, nullptr);
  std::vector<std::byte> file(16);
  std::memcpy(file.data(), "tilT\x10\0\1\0", 8);
  const std::vector<std::byte> archive = read_all(path);
  file.insert(file.end(), archive.begin(), archive.end());
  return file;
}

TEST(TiltFile, ReadsAllFieldsAndSkipsUnknownExtensions) {
  SketchBuilder b;
  b.header(1).stroke(0x1 | 0x2 | 0x10000, 0x1 | 0x2 | 0x4);
  b.put<std::uint32_t>(3).put(2.5F);                                                       // flags, scale
  b.put<std::uint32_t>(3).put<std::uint8_t>(1).put<std::uint8_t>(2).put<std::uint8_t>(3);  // unknown, 3 bytes
  b.put<std::int32_t>(2);
  b.point(1, 2, 3).put(0.25F).put<std::uint32_t>(1000).put<std::uint32_t>(9);
  b.point(4, 5, 6).put(1.5F).put<std::uint32_t>(1011).put<std::uint32_t>(9);
  const auto file = parse_tilt_sketch(b.bytes());
  ASSERT_TRUE(file.ok()) << file.error().describe();
  const TiltStroke& stroke = file->strokes.at(0);
  EXPECT_EQ(stroke.brush_index, 7);
  EXPECT_EQ(stroke.color[2], 0.3F);
  EXPECT_EQ(stroke.brush_size, 0.5F);
  EXPECT_EQ(stroke.scale, 2.5F);
  ASSERT_EQ(stroke.points.size(), 2U);
  EXPECT_EQ(stroke.points[0].position, (std::array{1.0F, 2.0F, 3.0F}));
  EXPECT_EQ(stroke.points[0].pressure, 0.25F);
  EXPECT_EQ(stroke.points[0].time_ms, 1000U);
  EXPECT_EQ(stroke.points[1].pressure, 1.0F) << "clamped";
}

TEST(TiltFile, MissingExtensionsGiveTheDefaults) {
  SketchBuilder b;
  b.header(1).stroke(0, 0).put<std::int32_t>(1).point(1, 2, 3);
  const auto file = parse_tilt_sketch(b.bytes());
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file->strokes[0].points[0].pressure, 1.0F);
  EXPECT_EQ(file->strokes[0].points[0].time_ms, 0U);
}

TEST(TiltFile, EveryTruncationIsAnErrorWithAField) {
  SketchBuilder b;
  b.header(1).stroke(2, 3).put(1.0F).put<std::int32_t>(2);
  for (int i = 0; i < 2; ++i) b.point(1, 2, 3).put(0.5F).put<std::uint32_t>(1);
  ASSERT_TRUE(parse_tilt_sketch(b.bytes()).ok());
  for (std::size_t n = 0; n < b.bytes().size(); ++n) {
    const auto file = parse_tilt_sketch(std::span(b.bytes()).first(n));
    ASSERT_FALSE(file.ok()) << n;
    EXPECT_FALSE(file.error().field.empty()) << n;
  }
}

TEST(TiltFile, ErrorsNameTheField) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  SketchBuilder position;
  position.header(1).stroke(0, 1).put<std::int32_t>(2).point(0, 0, 0).put(1.0F).point(0, nan, 0).put(1.0F);
  EXPECT_EQ(parse_tilt_sketch(position.bytes()).error().field, "strokes[0].points[1].position");
  SketchBuilder pressure;
  pressure.header(1).stroke(0, 1).put<std::int32_t>(1).point(0, 0, 0).put(nan);
  EXPECT_EQ(parse_tilt_sketch(pressure.bytes()).error().field, "strokes[0].points[0].pressure");
  SketchBuilder version;
  version.header(0, 99);
  EXPECT_EQ(parse_tilt_sketch(version.bytes()).error().code, ErrorCode::unsupported);
  SketchBuilder sentinel;
  sentinel.put<std::uint32_t>(1).put<std::uint32_t>(5).put<std::uint64_t>(0).put<std::uint32_t>(0);
  EXPECT_EQ(parse_tilt_sketch(sentinel.bytes()).error().field, "sketch.sentinel");
  SketchBuilder strokes;
  strokes.header(2'000'000'000);
  EXPECT_EQ(parse_tilt_sketch(strokes.bytes()).error().field, "sketch.stroke_count");
  SketchBuilder points;
  points.header(1).stroke(0, 0).put<std::int32_t>(2'000'000'000);
  EXPECT_EQ(parse_tilt_sketch(points.bytes(), {.max_points = std::size_t{1} << 40}).error().field,
            "strokes[0].point_count");
}

TEST(TiltFile, LimitsHold) {
  SketchBuilder b;
  b.header(2).stroke(0, 0).put<std::int32_t>(2).point(0, 0, 0).point(0, 0, 0);
  b.stroke(0, 0).put<std::int32_t>(1).point(0, 0, 0);
  ASSERT_TRUE(parse_tilt_sketch(b.bytes()).ok());
  EXPECT_EQ(parse_tilt_sketch(b.bytes(), {.max_points = 2}).error().code, ErrorCode::resource_exhausted);
  EXPECT_EQ(parse_tilt_sketch(b.bytes(), {.max_strokes = 1}).error().code, ErrorCode::resource_exhausted);
  EXPECT_EQ(parse_tilt(pack(b.bytes()), {.max_file_bytes = 50}).error().field, "file");
}

TEST(TiltFile, AZipBombStopsAtTheLimit) {
  const std::vector<std::byte> bomb = pack(std::vector<std::byte>(std::size_t{32} << 20));
  ASSERT_LT(bomb.size(), std::size_t{1} << 20);
  const auto file = parse_tilt(bomb, {.max_uncompressed_bytes = std::size_t{1} << 20});
  EXPECT_EQ(file.error().code, ErrorCode::resource_exhausted);
  EXPECT_EQ(file.error().field, "data.sketch");
}

TEST(TiltFile, DamagedArchivesAreErrors) {
  SketchBuilder b;
  b.header(1).stroke(0, 0).put<std::int32_t>(40);
  for (int i = 0; i < 40; ++i) b.point(static_cast<float>(i), 2, 3);
  const std::vector<std::byte> good = pack(b.bytes());
  ASSERT_TRUE(parse_tilt(good).ok());
  // The last bytes of an archive's directory are dispensable; nothing before it is.
  constexpr std::size_t end_of_directory = 22;
  for (std::size_t n = 0; n + end_of_directory <= good.size(); n += 7) {
    EXPECT_FALSE(parse_tilt(std::span(good).first(n)).ok()) << n;
  }
  std::vector<std::byte> flipped = good;
  flipped[16 + 60] ^= std::byte{0x55};  // Inside of the packed data: the checksum notices.
  EXPECT_FALSE(parse_tilt(flipped).ok());
  flipped = good;
  flipped[0] = std::byte{'T'};
  EXPECT_EQ(parse_tilt(flipped).error().field, "file.header");
}

TEST(TiltFile, MissingFilesAndFoldersAreErrors) {
  const test::TemporaryDirectory folder;
  EXPECT_EQ(read_tilt_file(folder.path() / "none.tilt").error().code, ErrorCode::not_found);
  EXPECT_EQ(read_tilt_file(folder.path()).error().code, ErrorCode::io);
}

TEST(TiltFile, RealSketch) {
  HANDLOFT_REQUIRE_DATA(path, "tilt/sketch1.tilt");
  const auto file = read_tilt_file(path);
  ASSERT_TRUE(file.ok()) << file.error().describe();
  EXPECT_EQ(file->strokes.size(), 5U);
  EXPECT_EQ(file->point_count(), 912U);
  EXPECT_FALSE(file->metadata_json.empty());
  for (const TiltStroke& stroke : file->strokes) {
    for (std::size_t i = 1; i < stroke.points.size(); ++i) {
      EXPECT_GE(stroke.points[i].time_ms, stroke.points[i - 1].time_ms);
    }
  }
}

TEST(TiltFile, RealTorch) {
  HANDLOFT_REQUIRE_DATA(path, "tilt/torch.tilt");
  const auto file = read_tilt_file(path);
  ASSERT_TRUE(file.ok()) << file.error().describe();
  EXPECT_EQ(file->strokes.size(), 33U);
  EXPECT_EQ(file->point_count(), 681U);
}

}  // namespace
}  // namespace handloft::codec
