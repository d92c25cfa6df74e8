# SPDX-License-Identifier: MIT
# A level that `relume bake --export-glb` wrote: Godot 3 reads no .glb while it runs, so it is read here.
extends Reference

# That are read.
const EXTENSIONS := ["KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_mesh_quantization", "KHR_node_visibility"]
const SIZES := {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # [bytes] of component types
const ONES := {5120: 127.0, 5121: 255.0, 5122: 32767.0, 5123: 65535.0}  # what stands for 1 where they are normalised

var error := "the level is damaged"
var code := 3         # 2: it cannot be read; 5: it has what is not read here
var scene_hash := ""  # of the bake that belongs to it
var surfaces := []    # {"mesh": ArrayMesh in world space, "material": dictionary of glTF's or null}
var images := []      # ImageTexture, sRGB
var bounds := AABB()
var camera := Transform()
var fov_y := 60.0  # [degrees], of the first perspective camera
var sun := {"intensity": Color(0, 0, 0), "transform": Transform()}   # [W/m²], linear
var lamp := {"intensity": Color(0, 0, 0), "transform": Transform()}  # [W/sr]
var receivers := []   # of vertices that the grid lights: [position, normal]

var _json := {}
var _bin := PoolByteArray()
var _set := -1
var _back_set := -1
var _unit := 1.0
var _has_camera := false
var _has_perspective := false

func read(path: String) -> bool:
	var file := File.new()
	if file.open(path, File.READ) != OK:
		code = 2
		return _fail(path + " cannot be read")
	var length := file.get_len()
	if length < 20 or file.get_32() != 0x46546C67 or file.get_32() != 2 or file.get_32() != length:
		return _fail(path + " is no whole binary glTF")
	while file.get_position() + 8 <= length:
		var size := file.get_32()
		var kind := file.get_32()
		if size > length - file.get_position():
			return _fail(path + ": a chunk is longer than the file")
		if kind == 0x4E4F534A:
			var parsed := JSON.parse(file.get_buffer(size).get_string_from_utf8())
			if parsed.error != OK or not parsed.result is Dictionary:
				return _fail(path + ": its JSON is damaged")
			_json = parsed.result
		else:
			_bin = file.get_buffer(size)
	for name in _json.get("extensionsRequired", []):
		if not name in EXTENSIONS:
			code = 5
			return _fail(path + ": requires the extension " + name + ", which is not read here")
	var map: Dictionary = _json.get("asset", {}).get("extras", {}).get("relume", {}).get("lightmap", {})
	if map.empty():
		return _fail(path + ": no light map: export it with relume bake --export-glb")
	scene_hash = map["sceneHash"]
	_set = int(map["texcoord"])
	_back_set = int(map.get("backTexcoord", -1))
	var scene: Dictionary = _json["scenes"][int(_json.get("scene", 0))]
	if scene.get("extras", {}).get("relume", {}).get("lightUnit", "") == "photometric":
		_unit = 1.0 / 683.0
	for image in _json.get("images", []):
		_add_image(_json["bufferViews"][int(image["bufferView"])], image["mimeType"])
	for node in scene["nodes"]:
		_add_node(_json["nodes"][int(node)], Transform(), true)
	return true

func _fail(text: String) -> bool:
	error = text
	return false

func _add_image(view: Dictionary, type: String) -> void:
	var first := int(view.get("byteOffset", 0))
	var bytes := _bin.subarray(first, first + int(view["byteLength"]) - 1)
	var image := Image.new()
	if type == "image/png":
		image.load_png_from_buffer(bytes)
	else:
		image.load_jpg_from_buffer(bytes)
	image.generate_mipmaps()
	images.append(ImageTexture.new())
	images[-1].create_from_image(image, Texture.FLAGS_DEFAULT)

# Numbers of an accessor, components after each other; integers as the fractions that they stand for where they are normalised.
func _numbers(accessor: Dictionary, components: int) -> Array:
	var numbers := []
	if not "bufferView" in accessor:  # zeros, as glTF has it
		numbers.resize(components * int(accessor["count"]))
		for i in numbers.size():
			numbers[i] = 0
		return numbers
	var view: Dictionary = _json["bufferViews"][int(accessor["bufferView"])]
	var kind := int(accessor["componentType"])
	var stride := int(view.get("byteStride", SIZES[kind] * components))
	var stream := StreamPeerBuffer.new()
	stream.data_array = _bin
	for i in int(accessor["count"]):
		stream.seek(int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0)) + i * stride)
		for _c in components:
			match kind:
				5120: numbers.append(stream.get_8())
				5121: numbers.append(stream.get_u8())
				5122: numbers.append(stream.get_16())
				5123: numbers.append(stream.get_u16())
				5125: numbers.append(stream.get_u32())
				5126: numbers.append(stream.get_float())
	if accessor.get("normalized", false):
		for i in numbers.size():
			numbers[i] = max(numbers[i] / ONES[kind], -1.0)
	return numbers

# Positions or normals as morph targets bend them. weights: of the targets, those that are missing are 0.
func _bent(primitive: Dictionary, name: String, weights: Array) -> PoolVector3Array:
	var sum := _numbers(_json["accessors"][int(primitive["attributes"][name])], 3)
	var targets: Array = primitive.get("targets", [])
	for t in int(min(weights.size(), targets.size())):
		if weights[t] == 0 or not name in targets[t]:
			continue
		var delta := _numbers(_json["accessors"][int(targets[t][name])], 3)
		for i in sum.size():
			sum[i] += weights[t] * delta[i]
	var vectors := PoolVector3Array()
	for i in range(0, sum.size(), 3):
		vectors.append(Vector3(sum[i], sum[i + 1], sum[i + 2]))
	return vectors

func _places(attributes: Dictionary, name: String, count: int) -> PoolVector2Array:
	var places := PoolVector2Array()
	var numbers := _numbers(_json["accessors"][int(attributes[name])], 2) if name in attributes else []
	for i in count:
		places.append(Vector2(1, 1) if numbers.empty() else Vector2(numbers[2 * i], numbers[2 * i + 1]))
	return places

func _add_primitive(primitive: Dictionary, world: Transform, weights: Array) -> void:
	var attributes: Dictionary = primitive["attributes"]
	if int(primitive.get("mode", 4)) != 4 or not "NORMAL" in attributes:
		return
	var vertices := _bent(primitive, "POSITION", weights)
	var normals := _bent(primitive, "NORMAL", weights)
	var normal_basis := world.basis.inverse().transposed()
	var count := vertices.size()
	var colors := PoolColorArray()
	var places := _places(attributes, "TEXCOORD_%d" % _set, count)
	var backs := _places(attributes, "TEXCOORD_%d" % _back_set, count)
	var material = _json["materials"][int(primitive["material"])] if "material" in primitive else null
	var two_sided: bool = material != null and material.get("doubleSided", false)
	for i in count:
		vertices[i] = world.xform(vertices[i])
		normals[i] = (normal_basis * normals[i]).normalized()
		bounds = AABB(vertices[i], Vector3()) if surfaces.empty() and i == 0 else bounds.expand(vertices[i])
		var receiver := -1
		if places[i] == Vector2(1, 1) or (two_sided and backs[i] == Vector2(1, 1)):
			receiver = receivers.size()
			receivers.append([vertices[i], normals[i]])
		colors.append(Color(backs[i].x, backs[i].y, receiver))
	var arrays := []
	arrays.resize(Mesh.ARRAY_MAX)
	arrays[Mesh.ARRAY_VERTEX] = vertices
	arrays[Mesh.ARRAY_NORMAL] = normals
	arrays[Mesh.ARRAY_COLOR] = colors
	arrays[Mesh.ARRAY_TEX_UV] = _places(attributes, "TEXCOORD_0", count)
	arrays[Mesh.ARRAY_TEX_UV2] = places
	var index := []
	if "indices" in primitive:
		index = _numbers(_json["accessors"][int(primitive["indices"])], 1)
	else:
		index = range(count)
	if world.basis.determinant() > 0.0:  # Godot's front faces are clockwise, as those that a node mirrors are already
		for i in range(0, index.size(), 3):
			var second = index[i + 1]
			index[i + 1] = index[i + 2]
			index[i + 2] = second
	arrays[Mesh.ARRAY_INDEX] = PoolIntArray(index)
	var mesh := ArrayMesh.new()
	mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays, [], 0)  # 0: halves are too coarse for light maps
	surfaces.append({"mesh": mesh, "material": material})

# The first perspective camera, or where there is none, the place of the first.
func _add_camera(lens: Dictionary, world: Transform) -> void:
	var is_perspective: bool = lens["type"] == "perspective"
	if _has_perspective or (_has_camera and not is_perspective):
		return
	camera = _rigid(world)
	if is_perspective:
		fov_y = rad2deg(lens["perspective"]["yfov"])
	_has_camera = true
	_has_perspective = is_perspective

# Scale, shear and mirroring of the nodes above change nothing of what a camera sees, nor where a light shines.
func _rigid(world: Transform) -> Transform:
	var z := world.basis.z.normalized()
	var x := world.basis.y.cross(z).normalized()
	return Transform(x, z.cross(x), z, world.origin)

# Of nodes that KHR_node_visibility hides, or below such a one, cameras alone are read, as bakes have it.
func _add_node(node: Dictionary, parent: Transform, is_parent_shown: bool) -> void:
	var extensions: Dictionary = node.get("extensions", {})
	var is_shown: bool = is_parent_shown and extensions.get("KHR_node_visibility", {}).get("visible", true)
	var local := Transform()
	var turn := Basis()  # without the node's own scale, unless it is in its matrix: a light's own scale does not turn it
	if "matrix" in node:
		var m: Array = node["matrix"]
		local = Transform(Vector3(m[0], m[1], m[2]), Vector3(m[4], m[5], m[6]), Vector3(m[8], m[9], m[10]), Vector3(m[12], m[13], m[14]))
		turn = local.basis
	else:
		var t: Array = node.get("translation", [0, 0, 0])
		var r: Array = node.get("rotation", [0, 0, 0, 1])
		var s: Array = node.get("scale", [1, 1, 1])
		turn = Basis(Quat(r[0], r[1], r[2], r[3]))
		local.basis = turn
		local.basis.x *= s[0]
		local.basis.y *= s[1]
		local.basis.z *= s[2]
		local.origin = Vector3(t[0], t[1], t[2])
	var world := parent * local
	if is_shown and "mesh" in node:
		var mesh: Dictionary = _json["meshes"][int(node["mesh"])]
		for primitive in mesh["primitives"]:
			_add_primitive(primitive, world, node.get("weights", mesh.get("weights", [])))
	if "camera" in node:
		_add_camera(_json["cameras"][int(node["camera"])], world)
	var punctual: Dictionary = extensions.get("KHR_lights_punctual", {})
	if is_shown and "light" in punctual:
		var light: Dictionary = _json["extensions"]["KHR_lights_punctual"]["lights"][int(punctual["light"])]
		var ours = {"directional": sun, "point": lamp}.get(light["type"])
		if ours != null and ours["intensity"] == Color(0, 0, 0):  # the first of each kind; spots are left to you
			var c: Array = light.get("color", [1, 1, 1])
			var i: float = _unit * light.get("intensity", 1.0)
			ours["intensity"] = Color(c[0] * i, c[1] * i, c[2] * i)
			ours["transform"] = _rigid(Transform(parent.basis * turn, world.origin))
	for child in node.get("children", []):
		_add_node(_json["nodes"][int(child)], world, is_shown)
