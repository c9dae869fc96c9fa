// The properties that a pipeline is specialized for. The compiler removes the rest, which software
// drivers would otherwise compute for every pixel.
override SURFACE: u32 = 0u;     // number of the pattern; 100 and more: without light
override SHADOWS: u32 = 2u;     // 0 none, 1 hard, 2 soft
override TEXTURED: bool = false;
override COAT: bool = true;      // whether there is a clear coat
override SOFTBOX: bool = true;   // whether there is a panel overhead
override OCCLUSION: bool = true; // whether the occlusion map was drawn
override REFLECTIONS: bool = true; // whether surfaces reflect the sky; otherwise light is a cheap approximation
override ONE_SUN: bool = false; // whether the only light is directional
override LIGHTS: u32 = 4u; // number of lights; 4: more than three
