#pragma once
// The desktop's 3D cursor as lines in space.

#include "client-hmd/render/cursor_mark.h"
#include "client-hmd/render/ribbon_pass.h"

namespace handloft::client {

/// `towards`: where the eye is. Nothing for what is no place.
void add_cursor(const CursorMark& cursor, const glm::vec3& towards, Ribbons& lines);

}  // namespace handloft::client
