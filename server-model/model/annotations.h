#pragma once
// What people add to a design beside its shapes (U6): named versions and comments, as messages and with the
// places where they are now.

#include <google/protobuf/repeated_field.h>

#include "proto/query.pb.h"
#include "server-model/geometry/types.h"
#include "server-model/model/document.h"

namespace handloft::model {

/// In the world, moved along with its entity since it was pinned; its last place when that is gone.
geometry::Vec3 place_now(const Document& document, const Comment& comment);

/// The comment as if it had been pinned now: what stays when its entity goes.
CommentPtr pinned_now(const Document& document, const CommentPtr& comment);

/// Where a comment on an entity is that names no place: the centre of the box about it; of what has no
/// extent, its origin.
geometry::Vec3 centre_of(const EntityPtr& entity);

enum class Resolved : std::uint8_t { left_out, among_them };

/// In the order of making, answers after what they answer. Of a thread that is resolved, all is left out.
void write_comments(const Document& document, Resolved resolved,
                    google::protobuf::RepeatedPtrField<handloft::v1::Comment>& to);

/// In the order of making.
void write_versions(const Document& document, google::protobuf::RepeatedPtrField<handloft::v1::Version>& to);

}  // namespace handloft::model
