#pragma once
// From icons to the surface: what they ask of it (sculpt_demands.h), the solution of least energy
// (geometry/sculpt_system.h), and where the icons then are (D14). The result depends on the
// shape's value alone, to the bit: what is kept between calls (factors, response columns) only makes it
// quick.

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server-model/model/document.h"
#include "server-model/model/sculpt_icon.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

/// Sets shape.surface, and its icons' places (D14), from the rest shape and the icons that act. Errors with
/// `field`: failed_precondition when constraints contradict each other (the icons are named; D20) or nothing
/// holds the surface against a load; resource_exhausted for more rows than the limit. Notes are of the icon
/// worked on (empty: none) and of others that became worse.
Status settle(SculptShape& shape, std::string_view field, const ApplyContext& context,
              std::vector<std::string>& notes, std::string_view worked_on = {});

}  // namespace handloft::model
