#include "common/net/message_parts.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <optional>
#include <string>

#include "proto/session.pb.h"

namespace handloft::net {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;

constexpr int deepest = 64;  ///< Ours nest nine deep.

Error cut(const Descriptor& message) {
  return make_error(ErrorCode::data_corrupt, "the bytes end within a field", std::string(message.name()));
}

/// The bytes of one message, from the front.
class WireReader {
 public:
  explicit WireReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  bool at_end() const { return rest_.empty(); }
  std::optional<std::uint64_t> varint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64 && !rest_.empty(); shift += 7) {
      const std::uint8_t byte = rest_.front();
      rest_ = rest_.subspan(1);
      value |= std::uint64_t{byte & 0x7FU} << shift;
      if ((byte & 0x80U) == 0) return value;
    }
    return std::nullopt;
  }
  std::optional<std::span<const std::uint8_t>> take(std::uint64_t count) {
    if (count > rest_.size()) return std::nullopt;
    const auto taken = rest_.first(static_cast<std::size_t>(count));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }

 private:
  std::span<const std::uint8_t> rest_;
};

class PartCounter {
 public:
  explicit PartCounter(std::size_t most) : most_(most) {}
  std::size_t parts() const { return parts_; }

  /// Any nesting is walked with a stack of our own depth, checked.
  Status walk(std::span<const std::uint8_t> bytes, const Descriptor& message, int depth) {
    if (depth > deepest) {
      return make_error(ErrorCode::data_corrupt, fmt::format("nested deeper than {}", deepest),
                        std::string(message.name()));
    }
    WireReader reader(bytes);
    while (!reader.at_end()) {
      const auto tag = reader.varint();
      if (!tag) return cut(message);
      if (const Status field = walk_field(reader, *tag, message, depth); !field) return field;
    }
    return {};
  }

 private:
  enum WireType : unsigned { varint = 0, fixed64 = 1, length = 2, group = 3, group_end = 4, fixed32 = 5 };

  Status walk_field(WireReader& reader, std::uint64_t tag, const Descriptor& message, int depth) {
    const FieldDescriptor* field = message.FindFieldByNumber(static_cast<int>(tag >> 3U));
    switch (static_cast<unsigned>(tag & 7U)) {
      case varint:
        if (!reader.varint()) return cut(message);
        return field == nullptr ? add(message) : Status();
      case fixed64:
        if (!reader.take(8)) return cut(message);
        return field == nullptr ? add(message) : Status();
      case fixed32:
        if (!reader.take(4)) return cut(message);
        return field == nullptr ? add(message) : Status();
      case group:
      case group_end:
        return add(message);  // None of ours; what is inside counts as unknown fields of this message.
      case length:
        break;
      default:
        return cut(message);
    }
    const auto size = reader.varint();
    const auto content = size ? reader.take(*size) : std::nullopt;
    if (!content) return cut(message);
    const bool numbers = field != nullptr && field->is_packable();
    if (numbers) return {};  // At most eight times their bytes.
    if (const Status added = add(message); !added) return added;
    const Descriptor* inner = field == nullptr ? nullptr : field->message_type();
    return inner == nullptr ? Status() : walk(*content, *inner, depth + 1);
  }

  Status add(const Descriptor& message) {
    if (++parts_ <= most_) return {};
    return make_error(ErrorCode::resource_exhausted, fmt::format("a message of more than {} parts", most_),
                      std::string(message.name()));
  }

  std::size_t most_;
  std::size_t parts_ = 0;
};

}  // namespace

Result<std::size_t> count_message_parts(std::span<const std::uint8_t> payload, std::size_t most_parts) {
  PartCounter counter(most_parts);
  if (const Status walked = counter.walk(payload, *v1::Envelope::descriptor(), 0); !walked) {
    return walked.error();
  }
  return counter.parts();
}

}  // namespace handloft::net
