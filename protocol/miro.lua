-- Wireshark dissector of the Mirotwin radio frames. Written by `python -m miro_protocol.dissector`; do not edit.
-- tshark -X lua_script:protocol/miro.lua -d rtacser.data,miro -r run.pcapng

local SYNC = "\x2D\xD4"
local RESIDUE = 14054
local XOR_OUT = 65535
local SEQ_MODULUS = 64
local SLOT_MASK = 7
local ROBOT_COUNTS = { 3, 5 }
local WHITE = { 255, 225, 29, 154, 237, 133, 51, 36, 234, 122, 210, 57, 112, 151, 87, 10, 84, 125, 45, 216, 109, 13, 186,
  143, 103, 89, 199, 162, 191, 52, 202 }
local CRC_TABLE = { 0, 31062, 62124, 35834, 48237, 50491, 20161, 14231, 8687, 22713, 54083, 43541, 40322, 58580, 28462, 5752,
  17374, 14984, 45426, 51236, 65459, 34533, 3359, 29769, 25137, 7015, 37021, 59851, 56924, 42762, 11504,
  21926, 34748, 65258, 29968, 3142, 15313, 17031, 51581, 45099, 42579, 57093, 21759, 11689, 6718, 25448,
  59538, 37316, 50274, 48436, 14030, 20376, 30735, 345, 35491, 62453, 58765, 40155, 5921, 28279, 23008, 8374,
  43852, 53786, 22093, 12059, 42209, 56759, 59936, 37750, 6284, 25050, 30626, 3828, 34062, 64600, 52175,
  45721, 14691, 16437, 5523, 27845, 59199, 40553, 43518, 53416, 23378, 8708, 13436, 19754, 50896, 49030,
  34833, 61767, 31421, 1003, 53745, 43175, 9053, 23051, 28060, 5322, 40752, 58982, 61470, 35144, 690, 31716,
  19571, 13605, 48863, 51081, 37423, 60281, 24707, 6613, 11842, 22292, 56558, 42424, 46016, 51862, 16748,
  14394, 4013, 30459, 64769, 33879, 44186, 54732, 24118, 10080, 4343, 27041, 57947, 39693, 36213, 62499,
  32729, 1679, 12568, 18510, 50100, 47842, 61252, 38418, 7656, 25790, 21289, 10879, 41349, 55507, 52907,
  47101, 15367, 17745, 29382, 2960, 32874, 63804, 11046, 21104, 55690, 41180, 38731, 60957, 26087, 7345, 2761,
  29599, 63589, 33075, 46756, 53234, 17416, 15710, 26872, 4526, 39508, 58114, 54421, 44483, 9785, 24431,
  18711, 12353, 48059, 49901, 62842, 35884, 2006, 32384, 64215, 33665, 2171, 28973, 18106, 16364, 46102,
  52544, 56120, 41582, 10644, 20674, 26453, 7683, 38393, 60591, 47369, 49247, 19365, 13043, 1380, 31794,
  63432, 36510, 39142, 57776, 27210, 4892, 9355, 24029, 54823, 44913, 32107, 1085, 36807, 63121, 49414, 47184,
  13226, 19196, 23684, 9682, 44584, 55166, 57577, 39359, 4677, 27411, 16053, 18403, 52249, 46415, 33496,
  64398, 28788, 2338, 8026, 26124, 60918, 38048, 41783, 55905, 20891, 10445 }
local NIBBLE_XOR = { 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 1, 0, 3, 2, 5, 4, 7, 6, 9, 8, 11, 10, 13, 12, 15, 14,
  2, 3, 0, 1, 6, 7, 4, 5, 10, 11, 8, 9, 14, 15, 12, 13, 3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12,
  4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 5, 4, 7, 6, 1, 0, 3, 2, 13, 12, 15, 14, 9, 8, 11, 10,
  6, 7, 4, 5, 2, 3, 0, 1, 14, 15, 12, 13, 10, 11, 8, 9, 7, 6, 5, 4, 3, 2, 1, 0, 15, 14, 13, 12, 11, 10, 9, 8,
  8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7, 9, 8, 11, 10, 13, 12, 15, 14, 1, 0, 3, 2, 5, 4, 7, 6,
  10, 11, 8, 9, 14, 15, 12, 13, 2, 3, 0, 1, 6, 7, 4, 5, 11, 10, 9, 8, 15, 14, 13, 12, 3, 2, 1, 0, 7, 6, 5, 4,
  12, 13, 14, 15, 8, 9, 10, 11, 4, 5, 6, 7, 0, 1, 2, 3, 13, 12, 15, 14, 9, 8, 11, 10, 5, 4, 7, 6, 1, 0, 3, 2,
  14, 15, 12, 13, 10, 11, 8, 9, 6, 7, 4, 5, 2, 3, 0, 1, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0 }
local DIRECTIONS = { [1] = ">", [3] = ">", [2] = "<", [4] = "<" }
local TYPES = { [0] = "team", [1] = "service", [2] = "telemetry", [3] = "team_ask" }
local FORMATS = {
  { name = "host to robot, N=3", robots = 3, direction = ">", lead = "\x55\x55\x55\x55\x55\xFF", size = 17, body = 13, register = 57366, types = { [0] = true, [1] = true, [3] = true } },
  { name = "host to robot, N=5", robots = 5, direction = ">", lead = "\x55\x55\x55\x55\x55\xFF", size = 25, body = 21, register = 44759, types = { [0] = true, [1] = true, [3] = true } },
  { name = "robot to host", robots = 0, direction = "<", lead = "\x55\x55\x55\x55\xFF", size = 14, body = 10, register = 1218, types = { [2] = true } },
}
local VELOCITY = {
  { name = "left", label = "left [1/256 count per LM629 sample]", size = 2, kind = "int16" },
  { name = "right", label = "right [1/256 count per LM629 sample]", size = 2, kind = "int16" },
}
local SERVICE = {
  { name = "slot", label = "slot", size = 1, kind = "uint8" },
  { name = "opcode", label = "opcode", size = 1, kind = "uint8" },
}
local OPCODES = { [0] = { name = "ping", fields = {  } }, [1] = { name = "filter", fields = { { name = "kp", label = "kp", size = 2, kind = "uint16" }, { name = "ki", label = "ki", size = 2, kind = "uint16" }, { name = "kd", label = "kd", size = 2, kind = "uint16" }, { name = "il", label = "il", size = 2, kind = "uint16" } } }, [2] = { name = "acceleration", fields = { { name = "acceleration", label = "acceleration [1/65536 count per sample^2]", size = 4, kind = "uint32" } } } }
local FLAGS = {
  { name = "stopped", label = "since its last answer: 110 ms without a fresh frame, smooth stop", mask = 8 },
  { name = "motors_off", label = "since its last answer: 500 ms without a fresh frame, motors off", mask = 16 },
  { name = "init_failed", label = "an LM629 did not come out of reset as it should; its motor stays off", mask = 32 },
}
local TELEMETRY = {
  { name = "slot_flags", label = "slot_flags", size = 1, kind = "uint8" },
  { name = "status_left", label = "status_left", size = 1, kind = "uint8" },
  { name = "status_right", label = "status_right", size = 1, kind = "uint8" },
  { name = "position_left", label = "position_left [count]", size = 2, kind = "uint16" },
  { name = "position_right", label = "position_right [count]", size = 2, kind = "uint16" },
  { name = "accepted", label = "accepted", size = 1, kind = "uint8" },
  { name = "rejected", label = "rejected", size = 1, kind = "uint8" },
}

local miro = Proto("miro", "Mirotwin radio")

local fields = {
  robots = ProtoField.uint8("miro.robots", "Robots in the network"),
  type = ProtoField.uint8("miro.type", "Type", base.DEC, TYPES, 256 - SEQ_MODULUS),
  seq = ProtoField.uint8("miro.seq", "Sequence number", base.DEC, nil, SEQ_MODULUS - 1),
  crc = ProtoField.uint16("miro.crc", "CRC", base.HEX),
  crc_calculated = ProtoField.uint16("miro.crc.calculated", "CRC calculated", base.HEX),
  crc_status = ProtoField.uint8("miro.crc.status", "CRC status", base.DEC, { [0] = "Bad", [1] = "Good" }),
  damage = ProtoField.string("miro.damage", "Damage"),
}

local function keep(field)
  fields[#fields + 1] = field
  return field
end

-- Gives each field of a payload its ProtoField, miro.PREFIX.NAME.
local function kept(prefix, list)
  local found = {}
  for place, row in ipairs(list) do
    local field = ProtoField[row.kind]("miro." .. prefix .. "." .. row.name, row.label)
    found[place] = { size = row.size, field = keep(field) }
  end
  return found
end

local VELOCITIES = {}
for slot = 0, math.max(ROBOT_COUNTS[1], ROBOT_COUNTS[2]) - 1 do
  VELOCITIES[slot + 1] = kept("slot" .. slot, VELOCITY)
end
SERVICE = kept("service", SERVICE)
for _, opcode in pairs(OPCODES) do opcode.fields = kept("service", opcode.fields) end
local parts = { keep(ProtoField.uint8("miro.telemetry.slot", "slot", base.DEC, nil, SLOT_MASK)) }
for _, flag in ipairs(FLAGS) do
  parts[#parts + 1] = keep(ProtoField.bool("miro.telemetry." .. flag.name, flag.label, 8, nil, flag.mask))
end
local first = table.remove(TELEMETRY, 1)
TELEMETRY = kept("telemetry", TELEMETRY)
table.insert(TELEMETRY, 1, { size = first.size, parts = parts })
miro.fields = fields

local damaged = ProtoExpert.new("miro.damaged", "Damaged", expert.group.CHECKSUM, expert.severity.WARN)
local unknown_content = ProtoExpert.new("miro.content", "Unknown content", expert.group.PROTOCOL, expert.severity.WARN)
miro.experts = { damaged, unknown_content }
local PAYLOADS

local choices = { { 1, "whatever makes the CRC good", 0 } }
for _, robots in ipairs(ROBOT_COUNTS) do choices[#choices + 1] = { robots, tostring(robots), robots } end
miro.prefs.robots = Pref.enum("Robots in the network", 0, "Decides how long a damaged frame was", choices, false)

local event_type = Field.new("rtacser.eventtype")

local function xor(a, b)
  local result, weight = 0, 1
  while a > 0 or b > 0 do
    result = result + weight * NIBBLE_XOR[a % 16 * 16 + b % 16 + 1]
    a, b, weight = math.floor(a / 16), math.floor(b / 16), weight * 16
  end
  return result
end

-- The register after the bytes of `clear`, which begins after the layout byte.
local function crc_register(register, clear, length)
  for place = 1, length do
    local index = xor(register % 256, clear[place]) % 256
    register = xor(math.floor(register / 256), CRC_TABLE[index + 1])
  end
  return register
end

-- HDR to CRC in clear, of the window whose sync stands at `start` (from 1).
local function clear_bytes(raw, start, format)
  local clear = {}
  for place = 1, format.body + 2 do
    clear[place] = xor(raw:byte(start + #SYNC + place - 1), WHITE[place])
  end
  return clear
end

local function candidates()
  local event = event_type()
  local direction = event and DIRECTIONS[event.value]
  local found = {}
  for _, format in ipairs(FORMATS) do
    local may_be = event == nil or format.direction == direction
    if format.robots > 0 and miro.prefs.robots > 0 and format.robots ~= miro.prefs.robots then may_be = false end
    if may_be then found[#found + 1] = format end
  end
  return found
end

-- The first window from `from` on with a good CRC: start, format, clear bytes.
local function find_frame(raw, from, formats)
  local start = raw:find(SYNC, from, true)
  while start do
    for _, format in ipairs(formats) do
      if start + format.size - 1 <= #raw then
        local clear = clear_bytes(raw, start, format)
        if crc_register(format.register, clear, format.body + 2) == RESIDUE then
          return start, format, clear
        end
      end
    end
    start = raw:find(SYNC, start + 1, true)
  end
end

local function lead_start(raw, head, start, format)
  for place = #format.lead, 1, -1 do
    if start - 1 < head or raw:byte(start - 1) ~= format.lead:byte(place) then return start end
    start = start - 1
  end
  return start
end

local function add_fields(tree, clear, list, offset)
  for _, entry in ipairs(list) do
    if entry.field then
      tree:add_le(entry.field, clear(offset, entry.size))
    end
    for _, part in ipairs(entry.parts or {}) do
      tree:add_le(part, clear(offset, entry.size))
    end
    offset = offset + entry.size
  end
  return offset
end

local function add_velocities(tree, clear, format)
  local offset, texts = 1, {}
  for slot = 0, format.robots - 1 do
    local left, right = clear(offset, 2):le_int(), clear(offset + 2, 2):le_int()
    local branch = tree:add(miro, clear(offset, 4), string.format("slot %d: %+d/%+d", slot, left, right))
    offset = add_fields(branch, clear, VELOCITIES[slot + 1], offset)
    texts[#texts + 1] = string.format("%+d/%+d", left, right)
  end
  return "  " .. table.concat(texts, " ")
end

local function add_service(tree, clear)
  local offset = add_fields(tree, clear, SERVICE, 1)
  local opcode = clear(offset - 1, 1):uint()
  local known = OPCODES[opcode]
  if known == nil then
    tree:add_proto_expert_info(unknown_content, "service opcode " .. opcode .. " is not known")
    return ""
  end
  add_fields(tree, clear, known.fields, offset)
  return string.format(" %s slot=%d", known.name, clear(1, 1):uint())
end

local function add_telemetry(tree, clear)
  add_fields(tree, clear, TELEMETRY, 1)
  return string.format(" slot=%d", clear(1, 1):uint() % (SLOT_MASK + 1))
end

local function add_crc(tree, range, received, calculated)
  tree:add(fields.crc, range, received)
  tree:add(fields.crc_calculated, range, calculated):set_generated()
  tree:add(fields.crc_status, range, received == calculated and 1 or 0):set_generated()
end

local function crc_values(clear, format)
  local register = crc_register(format.register, clear, format.body)
  return clear[format.body + 1] + 256 * clear[format.body + 2], xor(register, XOR_OUT)
end

local function add_frame(tvb, tree, head, start, format, clear)
  local size = start - head + format.size
  local bytes = ByteArray.new()
  bytes:set_size(format.body + 2)
  for place, value in ipairs(clear) do bytes:set_index(place - 1, value) end
  local branch = tree:add(miro, tvb(head - 1, size), "Mirotwin frame, " .. format.name)
  local body = bytes:tvb("Mirotwin frame in clear")
  if format.robots > 0 then
    branch:add(fields.robots, tvb(start - 1, 0), format.robots):set_generated()
  end
  branch:add(fields.type, body(0, 1))
  branch:add(fields.seq, body(0, 1))
  local kind = math.floor(clear[1] / SEQ_MODULUS)
  local text = string.format("%s seq=%d", TYPES[kind], clear[1] % SEQ_MODULUS)
  local add = PAYLOADS[kind]
  if format.types[kind] then
    text = text .. add(branch, body, format)
  else
    branch:add_proto_expert_info(unknown_content, "type " .. kind .. " is not sent in this direction")
  end
  add_crc(branch, body(format.body, 2), crc_values(clear, format))
  branch:append_text(", " .. text)
  return text
end

-- The furthest that a window got which starts in the run: text, and start and format of a bad CRC.
local function judge(raw, head, past, formats)
  local start = raw:find(SYNC, head, true)
  if start == nil or start >= past then return "no sync" end
  for _, format in ipairs(formats) do
    if start + format.size == #raw + 1 then return "bad crc", start, format end
  end
  for _, format in ipairs(formats) do
    if start + format.size <= #raw then return "bad crc", start, format end
  end
  return "cut short"
end

local function add_damage(tvb, tree, raw, head, past, formats)
  local reason, start, format = judge(raw, head, past, formats)
  local range = tvb(head - 1, past - head)
  local branch = tree:add(miro, range, string.format("Damaged: %s, %d bytes", reason, past - head))
  branch:add(fields.damage, range, reason):set_generated()
  if start then
    local from = start - 1 + format.size - 2
    add_crc(branch, tvb(from, 2), crc_values(clear_bytes(raw, start, format), format))
  end
  branch:add_proto_expert_info(damaged, reason)
  return string.format("damaged (%s, %d bytes)", reason, past - head)
end

function miro.dissector(tvb, pinfo, tree)
  local raw, formats = tvb:raw(), candidates()
  local head, texts = 1, {}
  while head <= #raw do
    local start, format, clear = find_frame(raw, head, formats)
    local begin = start and lead_start(raw, head, start, format) or #raw + 1
    if begin > head then
      texts[#texts + 1] = add_damage(tvb, tree, raw, head, begin, formats)
    end
    if not start then break end
    texts[#texts + 1] = add_frame(tvb, tree, begin, start, format, clear)
    head = start + format.size
  end
  pinfo.cols.protocol:set("Miro")
  pinfo.cols.info:set(table.concat(texts, "; "))
  return tvb:len()
end

PAYLOADS = {
  team = add_velocities, service = add_service, telemetry = add_telemetry, team_ask = add_velocities,
}
for kind, name in pairs(TYPES) do PAYLOADS[kind] = PAYLOADS[name] end

DissectorTable.get("rtacser.data"):add_for_decode_as(miro)
