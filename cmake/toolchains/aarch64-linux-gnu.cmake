# SPDX-License-Identifier: MIT
# Cross-build for 64-bit ARM on Debian (g++-aarch64-linux-gnu), run by qemu-user: the runtime and its tests, whose other
# packages are headers of no architecture. Presets `aarch64`; tests/aarch64.sh runs it.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64 -L /usr/aarch64-linux-gnu)
# The host's headers last: what is not of ARM's own C and C++ libraries is glm, cereal, xxHash and GoogleTest.
set(CMAKE_CXX_FLAGS_INIT "-idirafter /usr/include")
set(CMAKE_C_FLAGS_INIT "-idirafter /usr/include")
