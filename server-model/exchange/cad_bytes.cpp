#include "server-model/exchange/cad_bytes.h"

#include <fmt/format.h>

#include <BinTools.hxx>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <locale>
#include <span>
#include <sstream>
#include <streambuf>

#include "common/record/crc32c.h"

namespace handloft::exchange::detail {
namespace {

constexpr std::string_view magic = "HLBREP2\n";
constexpr std::string_view magic_without_labels = "HLBREP1\n";
constexpr std::size_t header_bytes = magic.size() + 8 + 4;  // Then length and checksum, lowest byte first.

std::string little_endian(std::uint64_t value, std::size_t count) {
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) bytes.push_back(static_cast<char>((value >> (8 * i)) & 0xFFU));
  return bytes;
}

std::uint32_t checksum(std::string_view bytes) {
  return record::crc32c({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

std::string header_of(std::string_view kind, std::string_view body) {
  return std::string(kind) + little_endian(body.size(), 8) + little_endian(checksum(body), 4);
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

Error damaged(std::size_t bytes) {
  return make_error(
      ErrorCode::data_corrupt,
      fmt::format("found {} bytes that are damaged or of another kind, expected a stored model", bytes),
      "boundary_representation");
}

void append(std::string& to, const std::string& text) {
  to += little_endian(text.size(), 4) + text;
}

std::string to_text(const std::vector<PartLabel>& labels) {
  std::string text = little_endian(labels.size(), 4);
  for (const PartLabel& label : labels) {
    text += little_endian(static_cast<std::uint64_t>(label.kind), 1) + little_endian(label.index, 4);
    append(text, label.name);
    append(text, label.product);
    text += little_endian(label.colour ? 1 : 0, 1);
    for (std::size_t i = 0; label.colour && i < label.colour->size(); ++i) {
      text += little_endian(std::bit_cast<std::uint32_t>((*label.colour)[i]), 4);
    }
  }
  return text;
}

/// Takes values from the front of bytes; after it ran out all are 0.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  std::uint64_t number(std::size_t count) {
    const std::string_view from = bytes(count);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
      value |= std::uint64_t{static_cast<unsigned char>(from[i])} << (8 * i);
    }
    return value;
  }
  std::string text() { return std::string(bytes(number(4))); }
  bool ran_out() const { return ran_out_; }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view bytes(std::uint64_t count) {
    ran_out_ = ran_out_ || count > rest_.size();
    if (ran_out_) return {};
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }

  std::string_view rest_;
  bool ran_out_ = false;
};

std::vector<PartLabel> read_labels(Reader& reader) {
  std::vector<PartLabel> labels;
  const std::uint64_t count = reader.number(4);
  for (std::uint64_t i = 0; i < count && !reader.ran_out(); ++i) {
    PartLabel& label = labels.emplace_back();
    label.kind = static_cast<TopAbs_ShapeEnum>(std::min<std::uint64_t>(reader.number(1), TopAbs_SHAPE));
    label.index = static_cast<std::uint32_t>(reader.number(4));
    label.name = reader.text();
    label.product = reader.text();
    if (reader.number(1) == 0) continue;
    for (float& part : label.colour.emplace()) {
      part = std::bit_cast<float>(static_cast<std::uint32_t>(reader.number(4)));
    }
  }
  return labels;
}

}  // namespace

Result<std::string> to_bytes(const StoredModel& model, std::size_t max_bytes) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  BinTools::Write(model.shape, stream, /*theWithTriangles=*/Standard_False,
                  /*theWithNormals=*/Standard_False, BinTools_FormatVersion_CURRENT);
  if (!stream || stream.view().empty()) {
    return make_error(ErrorCode::internal, "the CAD kernel didn't write the model", "path");
  }
  std::string body = to_text(model.labels);
  body += stream.view();
  if (body.size() + header_bytes > max_bytes) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("the model takes {} bytes, expected at most {}", body.size() + header_bytes, max_bytes),
        "path");
  }
  return header_of(magic, body) + body;
}

Result<StoredModel> from_bytes(std::string_view bytes) {
  if (bytes.size() <= header_bytes) return damaged(bytes.size());
  const std::string_view kind = bytes.substr(0, magic.size());
  const std::string_view body = bytes.substr(header_bytes);
  if ((kind != magic && kind != magic_without_labels) ||
      bytes.substr(0, header_bytes) != header_of(kind, body)) {
    return damaged(bytes.size());
  }
  StoredModel model;
  Reader reader(body);
  if (kind == magic) model.labels = read_labels(reader);
  if (reader.ran_out()) return damaged(bytes.size());
  ViewBuffer buffer(reader.rest());
  std::istream stream(&buffer);
  stream.imbue(std::locale::classic());
  BinTools::Read(model.shape, stream);
  if (model.shape.IsNull()) {
    return make_error(ErrorCode::data_corrupt, "found no shape, expected a stored model",
                      "boundary_representation");
  }
  return model;
}

}  // namespace handloft::exchange::detail
