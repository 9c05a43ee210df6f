#include "server-model/exchange/cad_bytes.h"

#include <fmt/format.h>

#include <BinTools.hxx>
#include <array>
#include <cstdint>
#include <locale>
#include <span>
#include <sstream>
#include <streambuf>
#include <utility>

#include "common/record/crc32c.h"

namespace handloft::exchange::detail {
namespace {

constexpr std::string_view magic = "HLBREP1\n";
constexpr std::size_t header_bytes = magic.size() + 8 + 4;  // Then length and checksum, lowest byte first.

std::string little_endian(std::uint64_t value, std::size_t count) {
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) bytes.push_back(static_cast<char>((value >> (8 * i)) & 0xFFU));
  return bytes;
}

std::uint32_t checksum(std::string_view bytes) {
  return record::crc32c({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

std::string header_of(std::string_view body) {
  return std::string(magic) + little_endian(body.size(), 8) + little_endian(checksum(body), 4);
}

/// Reads from bytes in place: a model's are many.
class ViewBuffer : public std::streambuf {
 public:
  explicit ViewBuffer(std::string_view bytes) {
    char* const begin = const_cast<char*>(bytes.data());  // NOLINT(cppcoreguidelines-pro-type-const-cast)
    setg(begin, begin, begin + bytes.size());
  }

 protected:
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    const off_type size = egptr() - eback();
    const off_type base = from == std::ios_base::beg   ? 0
                          : from == std::ios_base::end ? size
                                                       : gptr() - eback();
    const off_type target = base + offset;
    if (target < 0 || target > size) return pos_type(off_type(-1));
    setg(eback(), eback() + target, egptr());
    return pos_type(target);
  }
  pos_type seekpos(pos_type position, std::ios_base::openmode which) override {
    return seekoff(off_type(position), std::ios_base::beg, which);
  }
};

}  // namespace

Result<std::string> to_bytes(const TopoDS_Shape& shape, std::size_t max_bytes) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  BinTools::Write(shape, stream, /*theWithTriangles=*/Standard_False, /*theWithNormals=*/Standard_False,
                  BinTools_FormatVersion_CURRENT);
  const std::string_view body = stream.view();
  if (!stream || body.empty()) {
    return make_error(ErrorCode::internal, "the CAD kernel didn't write the model", "path");
  }
  if (body.size() + header_bytes > max_bytes) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("the model takes {} bytes, expected at most {}", body.size() + header_bytes, max_bytes),
        "path");
  }
  return header_of(body) + std::string(body);
}

Result<TopoDS_Shape> from_bytes(std::string_view bytes) {
  if (bytes.size() <= header_bytes || bytes.substr(0, magic.size()) != magic ||
      bytes.substr(0, header_bytes) != header_of(bytes.substr(header_bytes))) {
    return make_error(
        ErrorCode::data_corrupt,
        fmt::format("found {} bytes that are damaged or of another kind, expected a stored model",
                    bytes.size()),
        "boundary_representation");
  }
  ViewBuffer buffer(bytes.substr(header_bytes));
  std::istream stream(&buffer);
  stream.imbue(std::locale::classic());
  TopoDS_Shape shape;
  BinTools::Read(shape, stream);
  if (shape.IsNull()) {
    return make_error(ErrorCode::data_corrupt, "found no shape, expected a stored model",
                      "boundary_representation");
  }
  return shape;
}

}  // namespace handloft::exchange::detail
