#pragma once
// A bomb in a serialised message: a field that says "an empty entity" takes two bytes on the wire and
// hundreds in memory once it is parsed, so that a frame of 16 MiB could ask for gigabytes. This counts what
// parsing would build, by walking the bytes with the message's own description, and builds nothing.

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/result.h"

namespace handloft::net {

/// Sub-messages, texts and unknown fields of `payload` as an Envelope. Errors: resource_exhausted, naming the
/// field where more than `most_parts` were found; data_corrupt for bytes that end within a field or that nest
/// deeper than messages of ours do.
Result<std::size_t> count_message_parts(std::span<const std::uint8_t> payload, std::size_t most_parts);

}  // namespace handloft::net
