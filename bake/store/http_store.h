// SPDX-License-Identifier: MIT
// A store behind an HTTP server that takes PUT and GET: URL/ab/abcdef..., by libcurl.
#pragma once

#include "bake/store/store.h"

namespace relume {

// cancelled: asked several times a second while the server is waited for. usage: not an http:// or https:// URL.
Result<std::unique_ptr<Store>> openHttpStore(const std::string& url, std::function<bool()> cancelled);

}  // namespace relume
