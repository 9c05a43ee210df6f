#pragma once
// Saved state, comments, versions and people of the wire, held against limits before anything is kept (F1).

#include <memory>
#include <vector>

#include "client-hmd/mirror/limits.h"
#include "client-hmd/mirror/shared_work.h"
#include "common/base/result.h"
#include "proto/scene.pb.h"
#include "proto/session.pb.h"

namespace handloft::client {

// Errors: data_corrupt or resource_exhausted, naming the field.

Result<Storage> read_storage(const v1::StorageState& state, const MirrorLimits& limits);
Result<std::shared_ptr<const std::vector<PinnedComment>>> read_comments(const v1::CommentsState& state,
                                                                        const MirrorLimits& limits);
Result<std::shared_ptr<const std::vector<NamedVersion>>> read_versions(const v1::VersionsState& state,
                                                                       const MirrorLimits& limits);
/// Names are cut at the limit; more people than it are passed over.
std::shared_ptr<const std::vector<PersonHere>> read_people(const v1::People& people,
                                                           const MirrorLimits& limits);

}  // namespace handloft::client
