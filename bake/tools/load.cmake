# SPDX-License-Identifier: MIT
# What is read before anything is drawn, for the command line and the viewer: levels, bakes of them, lists of lights.
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
relume_room(relume_load load_scene.cpp lights_file.cpp)
target_link_libraries(relume_load PUBLIC relume::bake PRIVATE relume_check_mesh CLI11::CLI11 nlohmann_json::nlohmann_json)
