// Numbers of a script to the last bit, whichever they are: as a message, as a line of JSON, and as a message
// again.

#include <gtest/gtest.h>
// gtest first: RapidCheck's header does not include it.
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "proto/operation.pb.h"
#include "server-model/session/script_json.h"

namespace handloft::model {
namespace {

namespace v1 = handloft::v1;

template <typename Number, typename Bits>
rc::Gen<Number> any_number() {
  using Limits = std::numeric_limits<Number>;
  // Any bits: tiny, huge and denormal ones as often as others; and those where writers err.
  const auto of_bits = rc::gen::map(rc::gen::resize(100, rc::gen::arbitrary<Bits>()), [](Bits bits) {
    const auto number = std::bit_cast<Number>(bits);
    return std::isfinite(number) ? number : std::copysign(Number{0}, number);
  });
  return rc::gen::oneOf(
      of_bits, rc::gen::map(rc::gen::inRange(-1000, 1001), [](int i) { return static_cast<Number>(i) / 8; }),
      rc::gen::element(Number{0}, -Number{0}, Limits::denorm_min(), -Limits::denorm_min(), Limits::min(),
                       std::nextafter(Limits::min(), Number{0}), Limits::max(), Limits::lowest(),
                       Limits::epsilon(), std::ldexp(Number{1}, 53), std::ldexp(Number{-1}, 63),
                       std::ldexp(Number{1}, 64)));
}

rc::Gen<double> any_double() {
  return any_number<double, std::uint64_t>();
}

rc::Gen<float> any_float() {
  return any_number<float, std::uint32_t>();
}

void comes_back(const v1::Operation& operation) {
  const auto line = to_json(operation);
  RC_ASSERT(line.ok());
  v1::Operation back;
  const auto read = from_json(*line, back);
  RC_ASSERT(read.ok());
  // Bytes: two zeros are equal.
  RC_ASSERT(back.SerializeAsString() == operation.SerializeAsString());
  // Some lines are taken apart first, and written by the other library.
  const auto parsed = parse_json(*line);
  RC_ASSERT(parsed.ok());
  v1::Operation again;
  const auto read_again = from_json(parsed->dump(), again);
  RC_ASSERT(read_again.ok());
  RC_ASSERT(again.SerializeAsString() == operation.SerializeAsString());
}

RC_GTEST_PROP(ScriptNumbers, doubles_come_back_to_the_bit, ()) {
  v1::Operation operation;
  auto& curve = *operation.mutable_modify_profile()->add_curves();
  v1::Point& point = *curve.add_points();
  point.mutable_position()->set_x(*any_double());
  point.mutable_position()->set_y(*any_double());
  point.mutable_position()->set_z(*any_double());
  point.set_pressure(*any_double());
  for (const double at : *rc::gen::container<std::vector<double>>(any_double())) curve.add_split_at(at);
  comes_back(operation);
}

RC_GTEST_PROP(ScriptNumbers, floats_come_back_to_the_bit, ()) {
  v1::Operation operation;
  auto& mesh = *operation.mutable_import_reference()->mutable_resolved();
  for (const float position : *rc::gen::container<std::vector<float>>(any_float()))
    mesh.add_positions(position);
  comes_back(operation);
}

// What looks like a number in a text is none.
RC_GTEST_PROP(ScriptNumbers, texts_with_zeros_stay_as_they_are, ()) {
  const auto piece = rc::gen::element<std::string>("-0", ",-0]", "\"", "\\", "e-0,", "{\"a\":-0}", "\n", "é");
  v1::Operation operation;
  for (const std::string& some : *rc::gen::container<std::vector<std::string>>(piece))
    operation.mutable_rename()->mutable_name()->append(some);
  operation.mutable_rename()->set_entity(*piece);
  comes_back(operation);
}

}  // namespace
}  // namespace handloft::model
