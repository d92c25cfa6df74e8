# SPDX-License-Identifier: MIT
# What every command shares that is not about light: what it may write over, and text on its way to a terminal.
find_package(nlohmann_json REQUIRED)
relume_room(relume_frame output_files.cpp printable.cpp)
target_link_libraries(relume_frame PUBLIC relume_bake_core nlohmann_json::nlohmann_json)
