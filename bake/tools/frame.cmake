# SPDX-License-Identifier: MIT
# What every command shares that is not about light: what it may write over, text on its way to a terminal, what is
# wrong with a command line, how far the work is.
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
relume_room(relume_frame output_files.cpp overall_progress.cpp printable.cpp usage_message.cpp)
target_link_libraries(relume_frame PUBLIC relume_bake_core nlohmann_json::nlohmann_json PRIVATE CLI11::CLI11)
