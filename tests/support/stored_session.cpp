#include "tests/support/stored_session.h"

#include <random>
#include <stdexcept>

#include "server-model/model/canonical.h"
#include "server-model/store/recovery.h"

namespace handloft::test {

namespace v1 = handloft::v1;

StoredSession stored_session(std::size_t operations, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto below = [&](std::uint64_t limit) { return random() % limit; };
  StoredSession session;
  model::Model model;
  session.hashes.push_back(model::document_hash(model.document()));
  while (session.records.size() < operations) {
    v1::Operation operation;
    operation.set_client_id(1 + below(3));
    if (below(3) == 0) operation.set_client_op_id(session.records.size() + 1);
    const std::string entity = "shape-" + std::to_string(1 + below(3));
    switch (below(8)) {
      case 0:
        operation.mutable_create_dual_shape()->set_id(entity);
        break;
      case 1:
        operation.mutable_undo();
        break;
      case 2:
        operation.mutable_redo();
        break;
      case 3:
        operation.mutable_rename()->set_entity(entity);
        operation.mutable_rename()->set_name("name " + std::to_string(random() % 1000));
        break;
      case 4:
        operation.mutable_fit()->set_entity(entity);
        break;
      default:
        operation.mutable_add_points()->set_entity(entity);
        for (std::uint64_t i = 0; i < 3 + below(4); ++i) {
          v1::Point& point = *operation.mutable_add_points()->add_points();
          point.mutable_position()->set_x(1e-3 * static_cast<double>(below(200)));
          point.mutable_position()->set_y(1e-3 * static_cast<double>(below(200)));
          point.mutable_position()->set_z(1e-4 * static_cast<double>(below(200)));
          point.set_pressure(0.5);
        }
    }
    const auto submitted = model.submit(operation);
    if (!submitted || submitted->sequence == 0) continue;
    constexpr std::int64_t start_ns = 1'750'000'000'000'000'000;
    session.records.push_back(store::make_record(
        *submitted, 1, start_ns + static_cast<std::int64_t>(session.records.size()) * 1'000'000));
    session.hashes.push_back(model::document_hash(model.document()));
    if (session.records.size() == operations / 2) session.middle = {model.history(), model.sequence()};
  }
  return session;
}

}  // namespace handloft::test
