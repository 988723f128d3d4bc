% Replaces the class of the Robotics System Toolbox.
classdef rigidBodyJoint < handle
    properties
        Name = '';
        Type = 'fixed';
        JointAxis = [0 0 1];
        PositionLimits = [-pi pi];
        Fixed = eye(4);
    end
    methods
        function self = rigidBodyJoint(name, type)
            self.Name = name;
            if nargin > 1
                self.Type = type;
            end
        end
        function setFixedTransform(self, T)
            self.Fixed = T;
        end
    end
end
