model E05 "extends with redeclare type alias and conditional input"
  connector RealInput = input Real;
  connector RealOutput = output Real;
  block Limiter
    RealInput u; RealOutput y;
    parameter Real uMax(start=1) = 1, uMin = -uMax;
  equation
    assert(uMax >= uMin, "Limiter: uMax < uMin");
    y = homotopy(actual = smooth(0, if u > uMax then uMax else if u < uMin then uMin else u), simplified=u);
  end Limiter;
  block Sine
    RealOutput y;
    parameter Real f = 1, A = 2;
    constant Real pi = 2*acos(0);
  equation
    y = A*sin(2*pi*f*time);
  end Sine;
  Limiter l(uMax=1.5);
  Sine s;
  RealInput ext if useExt;
  parameter Boolean useExt = false;
equation
  connect(s.y, l.u);
  // expect: l.y @ 0.25 = 1.5
  // expect: l.y @ 0.75 = -1.5
  // expect: l.y @ 0.05 = 2*sin(0.1*pi)
end E05;
