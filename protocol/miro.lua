-- Wireshark dissector of the Mirotwin radio frames. Written by `python -m miro_protocol.dissector`; do not edit.
-- tshark -X lua_script:protocol/miro.lua -d rtacser.data,miro -r run.pcapng

local miro = Proto("miro", "Mirotwin radio")

local SYNC = "\x2D\xD4"
local RESIDUE, XOR_OUT = 0x36E6, 0xFFFF
local SEQ_MODULUS, SLOT_MASK = 64, 7
local WHITE = {
  0xFF, 0xE1, 0x1D, 0x9A, 0xED, 0x85, 0x33, 0x24, 0xEA, 0x7A, 0xD2, 0x39, 0x70, 0x97, 0x57, 0x0A,
  0x54, 0x7D, 0x2D, 0xD8, 0x6D, 0x0D, 0xBA, 0x8F, 0x67, 0x59, 0xC7, 0xA2, 0xBF, 0x34, 0xCA,
}
local CRC_TABLE = {
  0x0000, 0x7956, 0xF2AC, 0x8BFA, 0xBC6D, 0xC53B, 0x4EC1, 0x3797, 0x21EF, 0x58B9, 0xD343, 0xAA15, 0x9D82, 0xE4D4, 0x6F2E, 0x1678,
  0x43DE, 0x3A88, 0xB172, 0xC824, 0xFFB3, 0x86E5, 0x0D1F, 0x7449, 0x6231, 0x1B67, 0x909D, 0xE9CB, 0xDE5C, 0xA70A, 0x2CF0, 0x55A6,
  0x87BC, 0xFEEA, 0x7510, 0x0C46, 0x3BD1, 0x4287, 0xC97D, 0xB02B, 0xA653, 0xDF05, 0x54FF, 0x2DA9, 0x1A3E, 0x6368, 0xE892, 0x91C4,
  0xC462, 0xBD34, 0x36CE, 0x4F98, 0x780F, 0x0159, 0x8AA3, 0xF3F5, 0xE58D, 0x9CDB, 0x1721, 0x6E77, 0x59E0, 0x20B6, 0xAB4C, 0xD21A,
  0x564D, 0x2F1B, 0xA4E1, 0xDDB7, 0xEA20, 0x9376, 0x188C, 0x61DA, 0x77A2, 0x0EF4, 0x850E, 0xFC58, 0xCBCF, 0xB299, 0x3963, 0x4035,
  0x1593, 0x6CC5, 0xE73F, 0x9E69, 0xA9FE, 0xD0A8, 0x5B52, 0x2204, 0x347C, 0x4D2A, 0xC6D0, 0xBF86, 0x8811, 0xF147, 0x7ABD, 0x03EB,
  0xD1F1, 0xA8A7, 0x235D, 0x5A0B, 0x6D9C, 0x14CA, 0x9F30, 0xE666, 0xF01E, 0x8948, 0x02B2, 0x7BE4, 0x4C73, 0x3525, 0xBEDF, 0xC789,
  0x922F, 0xEB79, 0x6083, 0x19D5, 0x2E42, 0x5714, 0xDCEE, 0xA5B8, 0xB3C0, 0xCA96, 0x416C, 0x383A, 0x0FAD, 0x76FB, 0xFD01, 0x8457,
  0xAC9A, 0xD5CC, 0x5E36, 0x2760, 0x10F7, 0x69A1, 0xE25B, 0x9B0D, 0x8D75, 0xF423, 0x7FD9, 0x068F, 0x3118, 0x484E, 0xC3B4, 0xBAE2,
  0xEF44, 0x9612, 0x1DE8, 0x64BE, 0x5329, 0x2A7F, 0xA185, 0xD8D3, 0xCEAB, 0xB7FD, 0x3C07, 0x4551, 0x72C6, 0x0B90, 0x806A, 0xF93C,
  0x2B26, 0x5270, 0xD98A, 0xA0DC, 0x974B, 0xEE1D, 0x65E7, 0x1CB1, 0x0AC9, 0x739F, 0xF865, 0x8133, 0xB6A4, 0xCFF2, 0x4408, 0x3D5E,
  0x68F8, 0x11AE, 0x9A54, 0xE302, 0xD495, 0xADC3, 0x2639, 0x5F6F, 0x4917, 0x3041, 0xBBBB, 0xC2ED, 0xF57A, 0x8C2C, 0x07D6, 0x7E80,
  0xFAD7, 0x8381, 0x087B, 0x712D, 0x46BA, 0x3FEC, 0xB416, 0xCD40, 0xDB38, 0xA26E, 0x2994, 0x50C2, 0x6755, 0x1E03, 0x95F9, 0xECAF,
  0xB909, 0xC05F, 0x4BA5, 0x32F3, 0x0564, 0x7C32, 0xF7C8, 0x8E9E, 0x98E6, 0xE1B0, 0x6A4A, 0x131C, 0x248B, 0x5DDD, 0xD627, 0xAF71,
  0x7D6B, 0x043D, 0x8FC7, 0xF691, 0xC106, 0xB850, 0x33AA, 0x4AFC, 0x5C84, 0x25D2, 0xAE28, 0xD77E, 0xE0E9, 0x99BF, 0x1245, 0x6B13,
  0x3EB5, 0x47E3, 0xCC19, 0xB54F, 0x82D8, 0xFB8E, 0x7074, 0x0922, 0x1F5A, 0x660C, 0xEDF6, 0x94A0, 0xA337, 0xDA61, 0x519B, 0x28CD,
}
local NIBBLE_XOR = {
  0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15,
  1, 0, 3, 2, 5, 4, 7, 6, 9, 8, 11, 10, 13, 12, 15, 14,
  2, 3, 0, 1, 6, 7, 4, 5, 10, 11, 8, 9, 14, 15, 12, 13,
  3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12,
  4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11,
  5, 4, 7, 6, 1, 0, 3, 2, 13, 12, 15, 14, 9, 8, 11, 10,
  6, 7, 4, 5, 2, 3, 0, 1, 14, 15, 12, 13, 10, 11, 8, 9,
  7, 6, 5, 4, 3, 2, 1, 0, 15, 14, 13, 12, 11, 10, 9, 8,
  8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7,
  9, 8, 11, 10, 13, 12, 15, 14, 1, 0, 3, 2, 5, 4, 7, 6,
  10, 11, 8, 9, 14, 15, 12, 13, 2, 3, 0, 1, 6, 7, 4, 5,
  11, 10, 9, 8, 15, 14, 13, 12, 3, 2, 1, 0, 7, 6, 5, 4,
  12, 13, 14, 15, 8, 9, 10, 11, 4, 5, 6, 7, 0, 1, 2, 3,
  13, 12, 15, 14, 9, 8, 11, 10, 5, 4, 7, 6, 1, 0, 3, 2,
  14, 15, 12, 13, 10, 11, 8, 9, 6, 7, 4, 5, 2, 3, 0, 1,
  15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0,
}

local DIRECTIONS = { [1] = ">", [3] = ">", [2] = "<", [4] = "<" }
local TYPES = { [0] = "team", [1] = "service", [2] = "telemetry", [3] = "team_ask" }
local FORMATS = {
  { name = "host to robot, N=3", robots = 3, direction = ">", lead = "\x55\x55\x55\x55\x55\xFF",
    size = 17, body = 13, register = 0xE016, types = { [0] = true, [1] = true, [3] = true } },
  { name = "host to robot, N=5", robots = 5, direction = ">", lead = "\x55\x55\x55\x55\x55\xFF",
    size = 25, body = 21, register = 0xAED7, types = { [0] = true, [1] = true, [3] = true } },
  { name = "robot to host", robots = 0, direction = "<", lead = "\x55\x55\x55\x55\xFF",
    size = 14, body = 10, register = 0x04C2, types = { [2] = true } },
}

local fields = {
  robots = ProtoField.uint8("miro.robots", "Robots in the network"),
  type = ProtoField.uint8("miro.type", "Type", base.DEC, { [0] = "team", [1] = "service", [2] = "telemetry", [3] = "team_ask" }, 0xC0),
  seq = ProtoField.uint8("miro.seq", "Sequence number", base.DEC, nil, 0x3F),
  crc = ProtoField.uint16("miro.crc", "CRC", base.HEX),
  crc_calculated = ProtoField.uint16("miro.crc.calculated", "CRC calculated", base.HEX),
  crc_status = ProtoField.uint8("miro.crc.status", "CRC status", base.DEC, { [0] = "Bad", [1] = "Good" }),
  damage = ProtoField.string("miro.damage", "Damage"),
}

local function keep(field) fields[#fields + 1] = field; return field end
local VELOCITIES = {
  { { size = 2, field = keep(ProtoField.int16("miro.slot0.left", "left [1/256 count per LM629 sample]")) }, { size = 2, field = keep(ProtoField.int16("miro.slot0.right", "right [1/256 count per LM629 sample]")) } },
  { { size = 2, field = keep(ProtoField.int16("miro.slot1.left", "left [1/256 count per LM629 sample]")) }, { size = 2, field = keep(ProtoField.int16("miro.slot1.right", "right [1/256 count per LM629 sample]")) } },
  { { size = 2, field = keep(ProtoField.int16("miro.slot2.left", "left [1/256 count per LM629 sample]")) }, { size = 2, field = keep(ProtoField.int16("miro.slot2.right", "right [1/256 count per LM629 sample]")) } },
  { { size = 2, field = keep(ProtoField.int16("miro.slot3.left", "left [1/256 count per LM629 sample]")) }, { size = 2, field = keep(ProtoField.int16("miro.slot3.right", "right [1/256 count per LM629 sample]")) } },
  { { size = 2, field = keep(ProtoField.int16("miro.slot4.left", "left [1/256 count per LM629 sample]")) }, { size = 2, field = keep(ProtoField.int16("miro.slot4.right", "right [1/256 count per LM629 sample]")) } },
}
local SERVICE = {
  { size = 1, field = keep(ProtoField.uint8("miro.service.slot", "slot")) },
  { size = 1, field = keep(ProtoField.uint8("miro.service.opcode", "opcode")) },
}
local OPCODES = {
  [0] = { name = "ping", fields = {
  } },
  [1] = { name = "filter", fields = {
  { size = 2, field = keep(ProtoField.uint16("miro.service.kp", "kp")) },
  { size = 2, field = keep(ProtoField.uint16("miro.service.ki", "ki")) },
  { size = 2, field = keep(ProtoField.uint16("miro.service.kd", "kd")) },
  { size = 2, field = keep(ProtoField.uint16("miro.service.il", "il")) },
  } },
  [2] = { name = "acceleration", fields = {
  { size = 4, field = keep(ProtoField.uint32("miro.service.acceleration", "acceleration [1/65536 count per sample^2]")) },
  } },
}
local TELEMETRY = {
  { size = 1, parts = {
    keep(ProtoField.uint8("miro.telemetry.slot", "slot", base.DEC, nil, 0x07)),
    keep(ProtoField.bool("miro.telemetry.stopped", "since its last answer: 110 ms without a fresh frame, smooth stop", 8, nil, 0x08)),
    keep(ProtoField.bool("miro.telemetry.motors_off", "since its last answer: 500 ms without a fresh frame, motors off", 8, nil, 0x10)),
    keep(ProtoField.bool("miro.telemetry.init_failed", "an LM629 did not come out of reset as it should; its motor stays off", 8, nil, 0x20)),
  } },
  { size = 1, field = keep(ProtoField.uint8("miro.telemetry.status_left", "status_left")) },
  { size = 1, field = keep(ProtoField.uint8("miro.telemetry.status_right", "status_right")) },
  { size = 2, field = keep(ProtoField.uint16("miro.telemetry.position_left", "position_left [count]")) },
  { size = 2, field = keep(ProtoField.uint16("miro.telemetry.position_right", "position_right [count]")) },
  { size = 1, field = keep(ProtoField.uint8("miro.telemetry.accepted", "accepted")) },
  { size = 1, field = keep(ProtoField.uint8("miro.telemetry.rejected", "rejected")) },
}
miro.fields = fields

local damaged = ProtoExpert.new("miro.damaged", "Damaged", expert.group.CHECKSUM, expert.severity.WARN)
local unknown_content = ProtoExpert.new("miro.content", "Unknown content", expert.group.PROTOCOL, expert.severity.WARN)
miro.experts = { damaged, unknown_content }
local PAYLOADS

miro.prefs.robots = Pref.enum("Robots in the network", 0, "Decides how long a damaged frame was", { { 1, "whatever makes the CRC good", 0 }, { 3, "3", 3 }, { 5, "5", 5 } }, false)

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
