#pragma once
// Numbers and names in words, as all panels say them.

#include <cstddef>
#include <string>
#include <string_view>

#include "client-hmd/mirror/scene.h"

namespace handloft::client {

/// "1 point", "2 points".
std::string plural(std::size_t count, std::string_view noun);

/// At most `longest` bytes and an ellipsis, cut between characters.
std::string shortened(const std::string& text, std::size_t longest);

/// "points", "surface", "points + surface".
std::string_view representation_words(Representation representation);

/// "1,204": with separators from a thousand on.
std::string grouped(std::size_t number);

/// Whether `text` contains `part`, capitals and small Latin letters alike; everything contains nothing.
bool contains_words(std::string_view text, std::string_view part);

}  // namespace handloft::client
