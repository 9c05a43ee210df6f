#pragma once
// Operations as several clients send them, for tests of what a log keeps of them.

#include <cstdint>
#include <string>

#include "proto/operation.pb.h"

namespace handloft::store::test {

inline constexpr std::uint64_t ann = 1;
inline constexpr std::uint64_t bob = 2;

inline v1::Operation create(std::uint64_t client, const std::string& id) {
  v1::Operation operation;
  operation.set_client_id(client);
  operation.mutable_create_dual_shape()->set_id(id);
  return operation;
}

inline v1::Operation undo(std::uint64_t client) {
  v1::Operation operation;
  operation.set_client_id(client);
  operation.mutable_undo();
  return operation;
}

}  // namespace handloft::store::test
