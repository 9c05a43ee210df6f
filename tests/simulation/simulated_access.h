#pragma once
// Who may do what in a simulation, and since when not any more (U2): people of one host with roles in a real
// access file, which is changed beside the running server, as `handloft-modeld` does it.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/net/certificates.h"
#include "server-model/access/access_file.h"
#include "server-model/access/gate.h"
#include "tests/simulation/judge.h"
#include "tests/simulation/timeline.h"

namespace handloft::simulation {

class SimulatedAccess {
 public:
  enum class Change {
    written,
    forgotten,  ///< Negative control: who takes a role or a device away believes that it is done.
    another,    ///< Negative control: the device of somebody else is revoked.
  };
  /// All are owners to begin with.
  SimulatedAccess(Timeline& timeline, std::size_t people, Change change, Judge& judge);
  SimulatedAccess(const SimulatedAccess&) = delete;
  SimulatedAccess& operator=(const SimulatedAccess&) = delete;

  const std::shared_ptr<access::Gate>& gate() const { return gate_; }
  /// ROLE_UNSPECIFIED: none any more.
  void grant(std::size_t person, v1::Role role);
  /// Gives whoever has no device (any more) a certificate by a new invitation, as `handloft-modeld invite`
  /// and the pairing do.
  void pair(std::size_t person);
  /// Takes the device away, whose certificate they go on showing.
  void revoke_device(std::size_t person);
  bool was_revoked(std::size_t person) const { return revoked_.contains(person); }  ///< Once.
  /// What they show; nullopt: they come by the unix socket.
  std::optional<net::CertificateFacts> certificate_of(std::size_t person) const;
  /// Whether they might not have done that then: false for some moments after a change.
  bool was_forbidden(std::size_t person, const v1::Operation& operation, std::int64_t at_ns) const;
  std::uint64_t changes() const { return changes_; }

  static std::uint32_t uid_of(std::size_t person);
  /// In which the server sees that the file is another one: it looks every quarter of a second.
  static constexpr double seen_within_s = 1.0;

 private:
  Timeline& timeline_;
  const Change change_;
  Judge& judge_;
  /// In memory where there is such a place: what is on a disk after a crash is others' to test.
  struct Folder {
    Folder();
    ~Folder();
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    std::filesystem::path path;
  };
  Folder folder_;
  std::shared_ptr<access::Gate> gate_;
  std::unique_ptr<access::AccessFile> file_;
  std::uint64_t changes_ = 0;
  void forbid(std::size_t person, v1::Role role);
  void allow(std::size_t person);
  std::map<std::size_t, net::CertificateFacts> certificates_;  ///< By person.
  std::set<std::size_t> revoked_;                              ///< Persons, once,
  std::set<std::size_t> without_device_;                       ///< and now.
  /// In which somebody might not edit.
  struct Time {
    std::int64_t from_ns = 0, until_ns = 0;
    v1::Role role = v1::ROLE_UNSPECIFIED;
  };
  std::map<std::size_t, std::vector<Time>> forbidden_;  ///< By person.
};

}  // namespace handloft::simulation
